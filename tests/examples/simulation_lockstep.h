// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of simulation/lockstep take for granted.
#pragma once

#include "prescene/belief/scene.h"
#include "prescene/simulation/shape_store.h"

namespace prescene::simulation::given_simulation_lockstep {

extern const belief::Scene scene;
extern ShapeStore shapes;

}  // namespace prescene::simulation::given_simulation_lockstep
