// SPDX-License-Identifier: Apache-2.0
// What a robot (or person) does to the scene: the control U. Each action is defined by what it changes.
#pragma once

#include <optional>
#include <string>
#include <variant>

#include "prescene/belief/distribution.h"
#include "prescene/belief/joint.h"

namespace prescene::belief {

/// The hand opens: the object is free from `time` on, with the velocity of the body that held it, and that body backs
/// off along `retreat` (m, W) within `retreat_duration` so that it does not hold by accident.
struct Release {
  std::string object;
  Vector3d retreat = Vector3d::Zero();
  double retreat_duration = 0.2;
  /// What the opening hand adds to the object's velocity; drawn by whoever executes the action.
  TwistDistribution disturbance = {};
  friend bool operator==(const Release&, const Release&) = default;
};
/// The held object is carried in a straight line to X_WO within `duration` and released there at rest.
struct Place {
  std::string object;
  PoseDistribution X_WO = FixedPose{};
  double duration = 1.0;
  friend bool operator==(const Place&, const Place&) = default;
};
/// A sphere (finger tip) of `radius` moves from `from` to `to` (W) within `duration` and pushes what is in its way.
struct Push {
  Vector3d from = Vector3d::Zero();
  Vector3d to = Vector3d::Zero();
  double duration = 1.0;
  double radius = 0.015;
  ScalarDistribution lateral_error = FixedScalar{0.0};  ///< Shift of the path to its left, m.
  friend bool operator==(const Push&, const Push&) = default;
};
/// The held container is turned by `angle` (rad) about the horizontal `axis_W` within `duration`: its content leaves.
struct Pour {
  std::string container;
  Vector3d axis_W = Vector3d::UnitX();
  double angle = 0.0;
  double duration = 2.0;
  friend bool operator==(const Pour&, const Pour&) = default;
};
/// How hard two fingers press from both sides. They hold by friction: once more than `2 * friction * force` is needed
/// to make the object move with the hand (its weight, what it takes to accelerate it, a blow), the object slides
/// between the fingers, which then drag at it with just that force, against the slip (Coulomb's law; the force part of
/// the limit surface of R. D. Howe, M. R. Cutkosky, "Practical force-motion models for sliding manipulation", 1996). It
/// sticks again where less is needed. The pads keep its attitude: how far it may swing between them is not modelled.
struct Grip {
  ScalarDistribution force = FixedScalar{20.0};  ///< N, of each finger; >= 0.
  /// Between finger and object; nothing: that of contacts of the hand's body with the object.
  std::optional<ScalarDistribution> friction = {};
  double pad_length = 0.03;  ///< m, > 0: an object that has slid so far is out of the fingers.
  friend bool operator==(const Grip&, const Grip&) = default;
};
/// From now on the object moves with the robot body: rigidly, or as far as the grip holds.
struct Grasp {
  std::string object;
  std::string hand;
  std::optional<Grip> grip = {};
  friend bool operator==(const Grasp&, const Grasp&) = default;
};
/// The held object and its hand move to X_WO.
struct Transport {
  std::string object;
  PoseDistribution X_WO = FixedPose{};
  double duration = 1.0;
  friend bool operator==(const Transport&, const Transport&) = default;
};

/// A blow that is over at once. A hand that holds the object rigidly takes it; a grip may lose the object.
struct Bump {
  std::string object;
  Vector3Distribution impulse = {};      ///< N s, in W.
  std::optional<Vector3d> point_O = {};  ///< Where it hits, m; nothing: in line with the centre of mass.
  friend bool operator==(const Bump&, const Bump&) = default;
};
/// The held object is turned by `angle` (rad) about an axis through a point of it, and held so.
struct Tilt {
  std::string object;
  Vector3d axis_W = Vector3d::UnitX();
  double angle = 0.0;
  Vector3d pivot_O = Vector3d::Zero();  ///< A point of the axis, m.
  double duration = 1.0;
  friend bool operator==(const Tilt&, const Tilt&) = default;
};
/// A hand that is hooked in at a point of the object draws it: the hand moves by `by` (m, W) at constant speed, with no
/// more than `force`. It draws only, along `by`, and lets go at the end. Nothing holds the object otherwise.
struct Pull {
  std::string object;
  Vector3d by = Vector3d::Zero();
  double duration = 1.0;
  ScalarDistribution force = FixedScalar{30.0};  ///< N, > 0.
  std::optional<Vector3d> point_O = {};          ///< Nothing: the centre of mass.
  friend bool operator==(const Pull&, const Pull&) = default;
};
/// A hand at the handle of what hangs on a joint opens or closes it: in the first four fifths of the duration it takes
/// the joint to a position at constant speed, then holds it there, and lets go at the end; with no more than `force`,
/// along the way of the handle.
struct MoveJoint {
  std::string joint;
  JointType type = JointType::kSlider;  ///< Of the joint; validate() finds another.
  double to = 0.0;                      ///< rad or m
  double duration = 1.0;
  ScalarDistribution force = FixedScalar{30.0};  ///< N, > 0.
  std::optional<Vector3d> handle_C = {};         ///< Of the child, m; nothing: its centre of mass.
  friend bool operator==(const MoveJoint&, const MoveJoint&) = default;
};
/// The held object is moved by `distance` along `axis_W` into something: in the first four fifths of the duration at
/// constant speed. The hand gives way: it keeps the object on its line and in its attitude with no more than `force`
/// and `torque`, so that what is in the way may turn it aside or stop it. Then the hand opens.
struct Insert {
  std::string object;
  Vector3d axis_W = -Vector3d::UnitZ();
  double distance = 0.1;  ///< m
  double duration = 1.0;
  ScalarDistribution force = FixedScalar{20.0};  ///< N, > 0.
  ScalarDistribution torque = FixedScalar{1.0};  ///< N m, > 0.
  friend bool operator==(const Insert&, const Insert&) = default;
};
/// What a hand's motion takes of the duration of a MoveJoint or Insert; then it holds.
inline constexpr double kMovingShare = 0.8;

struct Action {
  double time = 0.0;  ///< s since the scene's start (of a query: since the snapshot)
  std::variant<Release, Place, Push, Pour, Grasp, Transport, Bump, Tilt, Pull, MoveJoint, Insert> what;
  friend bool operator==(const Action&, const Action&) = default;
};
/// "release", "place", ...
std::string kind_of(const Action& action);
/// The name of the object that it moves; empty for a push and for a joint that is moved.
std::string object_of(const Action& action);
/// The object has to be held when it begins.
bool is_of_held(const Action& action);
/// The object that it is about is free when it is over.
bool lets_go(const Action& action);

}  // namespace prescene::belief
