// SPDX-License-Identifier: Apache-2.0
// Options of nodes that no other process hears.
#pragma once

#include "prescene/interfaces/dds/dds_node.h"
#include "tests/support/bus_domain.h"

namespace prescene::interfaces::dds_tests {

inline DdsOptions options() {
  DdsOptions options;
  options.domain = tests::own_domain();
  return options;
}

}  // namespace prescene::interfaces::dds_tests
