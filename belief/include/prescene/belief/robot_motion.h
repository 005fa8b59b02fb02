// SPDX-License-Identifier: Apache-2.0
// Where the robot's bodies are while actions are executed.
#pragma once

#include <span>

#include "prescene/belief/scene.h"

namespace prescene::belief {

/// X_WG of robot body number `body` at `time` (s since the scene's start): its timeline; from a release of what it
/// holds, shifted along the retreat; during and after a place or transport of what it holds, carried with that object
/// to the action's mean pose (in a straight line, at constant speed) and staying there. `actions` ascend in time.
Pose robot_pose_at(const Scene& scene, std::span<const Action> actions, int body, double time);

}  // namespace prescene::belief
