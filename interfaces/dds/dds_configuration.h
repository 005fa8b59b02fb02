// SPDX-License-Identifier: Apache-2.0
// How Cyclone DDS is set up for a node.
#pragma once

#include <string>

#include "prescene/core/status.h"
#include "prescene/interfaces/dds/dds_node.h"

namespace prescene::interfaces {

/// InvalidInput where a network interface or a peer is no name or address, or CYCLONEDDS_URI names interfaces, too.
core::Status check_network(const DdsOptions& options);

/// Elements below CycloneDDS/Domain as XML, of checked options, and what CYCLONEDDS_URI says: that comes last, so that
/// the user has the last word but on interfaces and peers, of which there are several.
std::string configuration_of(const DdsOptions& options);

}  // namespace prescene::interfaces
