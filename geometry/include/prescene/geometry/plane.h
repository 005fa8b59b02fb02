// SPDX-License-Identifier: Apache-2.0
// Planes n.p + d = 0.
#pragma once

#include "prescene/geometry/pose.h"

namespace prescene::geometry {

/// Unit normal and offset in metres, in a frame that the name of the value says (plane_W, plane_C).
struct Plane {
  Vector3d normal = Vector3d::UnitZ();
  double offset = 0.0;

  double signed_distance(const Vector3d& p) const { return normal.dot(p) + offset; }
  friend bool operator==(const Plane&, const Plane&) = default;
};

/// plane_A from plane_B.
Plane transformed(const Plane& plane_B, const Pose& X_AB);

}  // namespace prescene::geometry
