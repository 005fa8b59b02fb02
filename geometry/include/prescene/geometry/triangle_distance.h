// SPDX-License-Identifier: Apache-2.0
// How far a point is from a triangle, and which of the triangle's points is the nearest.
#pragma once

#include "prescene/geometry/pose.h"

namespace prescene::geometry {

/// The place in a triangle a, b, c that is nearest to a point.
struct PlaceInTriangle {
  Vector3d weights = Vector3d::Zero();  ///< The place is weights[0] a + weights[1] b + weights[2] c; sum 1, none < 0.
  double squared_distance = 0.0;        ///< m^2
};
/// [Ericson 2005, section 5.1.5]. A triangle without area is the segment or point that is left of it.
PlaceInTriangle nearest_in_triangle(const Vector3d& p, const Vector3d& a, const Vector3d& b, const Vector3d& c);

/// Squared distance, m^2, of a point to the triangle.
inline double squared_distance_to_triangle(const Vector3d& p, const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  return nearest_in_triangle(p, a, b, c).squared_distance;
}

}  // namespace prescene::geometry
