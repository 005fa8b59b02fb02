// SPDX-License-Identifier: Apache-2.0
// How far a point is from a triangle.
#pragma once

#include "prescene/geometry/pose.h"

namespace prescene::geometry {

/// Squared distance, m^2, of a point to the triangle a, b, c [Ericson 2005, section 5.1.5]. A triangle without area is
/// the segment or point that is left of it.
double squared_distance_to_triangle(const Vector3d& p, const Vector3d& a, const Vector3d& b, const Vector3d& c);

}  // namespace prescene::geometry
