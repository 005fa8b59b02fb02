// SPDX-License-Identifier: Apache-2.0
// Where a camera looks whose picture is upright.
//
//   const Pose X_WC{Quaterniond(level_camera((target - eye).normalized())), eye};
#pragma once

#include "prescene/geometry/pose.h"

namespace prescene::geometry {

/// R_WC of a camera that looks along `forward`, a unit vector that is not vertical: x is level, and y as far down as it
/// can be, in a world W with z up.
inline Matrix3d level_camera(const Vector3d& forward) {
  Matrix3d R_WC;
  R_WC.col(2) = forward;
  R_WC.col(0) = forward.cross(Vector3d::UnitZ()).normalized();
  R_WC.col(1) = forward.cross(R_WC.col(0));
  return R_WC;
}

}  // namespace prescene::geometry
