// SPDX-License-Identifier: Apache-2.0
// One hypothesis of how the world is now.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "prescene/belief/joint.h"
#include "prescene/belief/object_model.h"

namespace prescene::belief {

/// How an object moves now.
enum class MotionMode { kResting, kHeld, kMoving };

/// The drawn physical parameters of one object.
struct PhysicalParameters {
  double mass = 1.0;                           ///< kg
  Vector3d center_of_mass = Vector3d::Zero();  ///< p_OoOcm, m
  double friction = 0.5;
  double impact_friction = 0.5;
  double restitution = 0.1;
  friend bool operator==(const PhysicalParameters&, const PhysicalParameters&) = default;
};

/// One object of a world state.
struct ObjectState {
  Pose X_WO;
  Twist V_WO;  ///< Of O's origin, expressed in W.
  MotionMode mode = MotionMode::kMoving;
  PhysicalParameters physical;
  friend bool operator==(const ObjectState&, const ObjectState&) = default;
};

/// States of all objects of a scene, in the scene's order.
struct WorldState {
  double time = 0.0;  ///< Seconds since the scene's start.
  std::vector<ObjectState> objects;
  std::vector<JointParameters> joints = {};  ///< In the order of Scene::joints; empty = the means of the scene's.
  friend bool operator==(const WorldState&, const WorldState&) = default;
};

}  // namespace prescene::belief
