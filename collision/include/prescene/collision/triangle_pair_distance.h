// SPDX-License-Identifier: Apache-2.0
// The distance of two triangles with the points where it is: in double precision for an answer, in single precision as
// the scalar twin of the kernel of triangle_distance-inl.h, which finds the pairs that are worth an answer.
#pragma once

#include <Eigen/Core>

#include "prescene/collision/exact_triangles.h"
#include "prescene/collision/triangle_pairs.h"

namespace prescene::collision {

/// p_A and p_B are points of the triangles a and b (up to rounding), in the frame that both are given in.
struct TriangleDistance {
  double distance = 0.0;  ///< m. Zero exactly where the triangles intersect (then p_A = p_B), positive elsewhere.
  Eigen::Vector3d p_A = Eigen::Vector3d::Zero();
  Eigen::Vector3d p_B = Eigen::Vector3d::Zero();
};

/// The smallest of the distances of nine pairs of edges and of six corners from the other's face [Ericson 2005, 5.1];
/// whether they intersect is decided exactly. Triangles without area are segments or points. The distance is off by at
/// most 1e-13 of the size of the box about both triangles, for needles too.
TriangleDistance triangle_pair_distance(const Triangle& a, const Triangle& b);

/// The same for triangles that are known not to intersect.
TriangleDistance disjoint_pair_distance(const Triangle& a, const Triangle& b);

/// The kernel's distance in plain C++; zero for a pair that intersects or may do so.
float single_triangle_pair_distance(const TriangleCoordinates& a, const TriangleCoordinates& b);

}  // namespace prescene::collision
