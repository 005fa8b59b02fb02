// SPDX-License-Identifier: Apache-2.0
// What a robot (or person) does to the scene: the control U. Each action is defined by what it changes.
#pragma once

#include <optional>
#include <string>
#include <variant>

#include "prescene/belief/distribution.h"

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
/// From now on the object moves rigidly with the robot body.
struct Grasp {
  std::string object;
  std::string hand;
  friend bool operator==(const Grasp&, const Grasp&) = default;
};
/// The held object and its hand move to X_WO.
struct Transport {
  std::string object;
  PoseDistribution X_WO = FixedPose{};
  double duration = 1.0;
  friend bool operator==(const Transport&, const Transport&) = default;
};

struct Action {
  double time = 0.0;  ///< s since the scene's start (of a query: since the snapshot)
  std::variant<Release, Place, Push, Pour, Grasp, Transport> what;
  friend bool operator==(const Action&, const Action&) = default;
};
/// "release", "place", ...
std::string kind_of(const Action& action);
/// The name of the object that it moves; empty for a push.
std::string object_of(const Action& action);

}  // namespace prescene::belief
