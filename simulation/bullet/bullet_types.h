// SPDX-License-Identifier: Apache-2.0
// Conversions between our vectors and Bullet's.
#pragma once

#include <LinearMath/btMatrix3x3.h>
#include <LinearMath/btTransform.h>
#include <LinearMath/btVector3.h>

#include "prescene/geometry/pose.h"

namespace prescene::simulation {

using geometry::Matrix3d;
using geometry::Pose;
using geometry::Quaterniond;
using geometry::Twist;
using geometry::Vector3d;

inline btVector3 to_bullet(const Vector3d& v) { return {v.x(), v.y(), v.z()}; }
inline Vector3d from_bullet(const btVector3& v) { return {v.x(), v.y(), v.z()}; }
inline btTransform to_bullet(const Matrix3d& R, const Vector3d& p) {
  const btMatrix3x3 rotation(R(0, 0), R(0, 1), R(0, 2), R(1, 0), R(1, 1), R(1, 2), R(2, 0), R(2, 1), R(2, 2));
  return btTransform(rotation, to_bullet(p));
}

}  // namespace prescene::simulation
