// SPDX-License-Identifier: Apache-2.0
// What of a scene stands in a planner's way.
//
//   PRESCENE_TRY(const auto obstacles, scene_obstacles(scene, arm->bodies(), pool));
#pragma once

#include <string>
#include <vector>

#include "prescene/belief/scene.h"
#include "prescene/interfaces/planning/motion_checker.h"

namespace prescene::interfaces {

/// Supports, bodies of the robot where their timelines begin, and objects at the means of their poses, besides those
/// named in `without`: what is planned for. Fails with kInvalidInput when a name in it is none of these or a body's
/// mesh is not in order.
core::Result<std::vector<Obstacle>> scene_obstacles(const belief::Scene& scene, const std::vector<std::string>& without,
                                                    core::ThreadPool& pool);

}  // namespace prescene::interfaces
