// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of simulation/bullet take for granted.
#pragma once

#include "prescene/belief/scene.h"
#include "prescene/simulation/bullet/convex_decomposition.h"

namespace prescene::simulation::given_simulation_bullet {

extern const belief::Scene scene;

}  // namespace prescene::simulation::given_simulation_bullet
