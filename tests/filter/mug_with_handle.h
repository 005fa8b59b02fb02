// SPDX-License-Identifier: Apache-2.0
// A mug on the tests' table, whose turn is known by its handle alone.
#pragma once

#include <cmath>

#include "prescene/belief/object_model.h"
#include "prescene/geometry/pose.h"
#include "simulated_sequence.h"

namespace prescene::filter_tests {

inline belief::ObjectModel mug_with_handle() {
  belief::ObjectModel mug;
  mug.name = "mug";
  mug.collision.push_back(belief::PrimitiveShape{geometry::Cylinder{0.038, 0.095}, Pose::identity()});
  mug.collision.push_back(
      belief::PrimitiveShape{geometry::BoxShape{{0.03, 0.012, 0.06}}, Pose::from_translation({0.051, 0.0, 0.0})});
  mug.mass = belief::FixedScalar{0.3};
  mug.symmetry = geometry::SymmetryGroup::cyclic(Vector3d::UnitX(), 2);  // about its handle
  return *belief::with_derived_properties(mug);
}

/// On the table, its handle turned by `angle` from W's x axis.
inline Pose mug_pose(double angle) { return {geometry::exp_rotation({0.0, 0.0, angle}), {0.02, -0.03, 0.0475}}; }

/// The angle at which the handle points away from the camera.
inline double angle_behind() {
  const Vector3d away = mug_pose(0.0).translation - test_camera_pose().translation;
  return std::atan2(away.y(), away.x());
}

}  // namespace prescene::filter_tests
