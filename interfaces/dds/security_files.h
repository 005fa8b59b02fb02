// SPDX-License-Identifier: Apache-2.0
// DDS Security by configuration: the properties of a participant that name its certificates and permissions.
#pragma once

#include <filesystem>

#include <dds/dds.h>
#include "prescene/core/status.h"

namespace prescene::interfaces {

/// Puts the files of an SROS 2 enclave into the participant's QoS. kInvalidInput naming the file that is missing
/// or can't be read.
core::Status use_security(const std::filesystem::path& folder, dds_qos_t* qos);

}  // namespace prescene::interfaces
