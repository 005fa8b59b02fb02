// SPDX-License-Identifier: Apache-2.0
// A scene as the lockstep stages need it, and what of it stays in double precision.
#pragma once

#include <memory>
#include <vector>

#include "lane_state.h"
#include "prescene/belief/scene.h"
#include "prescene/simulation/lockstep/lockstep_simulator.h"

namespace prescene::simulation {

struct CompiledLockstep {
  belief::Scene scene;
  LockstepOptions options;
  std::uint64_t hash = 0;  ///< Of what steps depend on.
  LockstepScene lanes;
  std::vector<geometry::Quaterniond> R_OP;  ///< Principal axes, by object.
  std::vector<int> robot_bodies;            ///< In lanes.bodies, by robot body; -1: it has no shape.
  double hull_error = 0.0;                  ///< m: the largest of all parts.
  std::vector<double> pushers;              ///< Their radii; the last of lanes.bodies.

  int pusher_body(std::size_t pusher) const { return static_cast<int>(lanes.bodies.size() - pushers.size() + pusher); }
};

std::vector<double> pusher_radii(const std::vector<belief::Action>& actions);
/// kUnsupported where there are more push actions than lanes have room for, or hands that drive what has contacts.
core::Status check_actions(const std::vector<belief::Action>& actions);
/// A copy that has the balls of push actions, too.
std::shared_ptr<const CompiledLockstep> with_pushers(const CompiledLockstep& compiled,
                                                     const std::vector<double>& radii);

core::Result<std::shared_ptr<const CompiledLockstep>> compile_lockstep(const belief::Scene& scene, ShapeStore& shapes,
                                                                       const LockstepOptions& options);

}  // namespace prescene::simulation
