// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of simulation/rules take for granted: nothing.
#pragma once

namespace prescene::simulation::given_simulation_rules {}
