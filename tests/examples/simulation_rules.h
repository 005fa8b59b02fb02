// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of simulation/rules take for granted.
#pragma once

#include "prescene/simulation/rules/mechanics_options.h"

namespace prescene::simulation::given_simulation_rules {

extern const MechanicsOptions options;

}  // namespace prescene::simulation::given_simulation_rules
