// SPDX-License-Identifier: Apache-2.0
// A scene as the lockstep stages need it, and what of it stays in double precision.
#pragma once

#include <memory>

#include "lane_state.h"
#include "prescene/belief/scene.h"
#include "prescene/simulation/lockstep/lockstep_simulator.h"

namespace prescene::simulation {

struct CompiledLockstep {
  belief::Scene scene;
  LockstepOptions options;
  LockstepScene lanes;
  geometry::Quaterniond R_OP;  ///< Principal axes of the object.
};

core::Result<std::shared_ptr<const CompiledLockstep>> compile_lockstep(const belief::Scene& scene, ShapeStore& shapes,
                                                                       const LockstepOptions& options);

}  // namespace prescene::simulation
