// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of interfaces/mesh_files take for granted.
#pragma once

#include "prescene/core/log.h"

namespace prescene::interfaces::given_interfaces_mesh_files {

extern const core::LogSink sink;

}  // namespace prescene::interfaces::given_interfaces_mesh_files
