// SPDX-License-Identifier: Apache-2.0
// Where the robot's bodies are while actions are executed.
#pragma once

#include <functional>
#include <span>

#include "prescene/belief/scene.h"
#include "prescene/belief/world_state.h"

namespace prescene::belief {

/// X_WG of robot body number `body` at `time` (s since the scene's start): its timeline; from a release of what it
/// holds, shifted along the retreat; during and after a place or transport of what it holds, carried with that object
/// to the action's mean pose (that in a straight line, at constant speed) and staying there; turned with it by a pour
/// or tilt, and moved with it by an insertion, as if nothing were in the way. If it is let go of on such a way, the
/// body stays where it is then. It holds what the scene says, and what it grasps until an action lets go of it: where
/// that is when it is grasped follows from the scene's mean start and the actions before, as if nothing else had moved
/// it. `actions` ascend in time.
Pose robot_pose_at(const Scene& scene, std::span<const Action> actions, int body, double time);

/// From where hands are followed, where more is known than the scene's mean start.
struct MotionStart {
  const WorldState* state = nullptr;  ///< Of the scene's objects; null: the mean start. Must outlive the call.
  /// X_GO by which a hand takes that object at `time` (s); X_WG(t): where the hand is from then on as long as no other
  /// action begins. Empty: it takes the object where the start, or the hand that let go of it last, left it.
  std::function<Pose(int object, double time, const std::function<Pose(double t)>& X_WG)> grasped = {};
};

/// The same of one instance: times of actions count from the start's, `time` from the scene's start. Drawn actions have
/// fixed goals.
Pose robot_pose_at(const Scene& scene, std::span<const Action> actions, const MotionStart& start, int body,
                   double time);
/// X_WO of object number `object` then: where its hand has it, else where it was left.
Pose object_pose_at(const Scene& scene, std::span<const Action> actions, const MotionStart& start, int object,
                    double time);

/// For how long (s) an action moves something: a release, while the hand retreats. 0 for what is done at once.
double duration_of(const Action& action);

/// Share of a motion from `begin` on, at constant speed for `duration` (s), that is done at `time`; 0 before it and 1
/// after it.
double share_done(double begin, double duration, double time);
/// The same of a MoveJoint or Insert of that duration, which moves in the first part of it (kMovingShare).
double moved_share(double begin, double duration, double time);
/// Turned by an angle (rad) about an axis in W through a point of the object.
Pose turned_about(const Pose& X_WO, const Vector3d& pivot_O, const Vector3d& axis_W, double angle);

}  // namespace prescene::belief
