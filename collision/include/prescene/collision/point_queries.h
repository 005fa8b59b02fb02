// SPDX-License-Identifier: Apache-2.0
// Where a body's surface is nearest to a point, and how often it winds around it. Points are given and answered in the
// frame of the body's mesh, in double precision.
//
//   if (const auto nearest = nearest_point(cup, p_CQ, 0.1)) ... nearest->distance, nearest->point
//   const bool inside = winding_number(cup, p_CQ) > 0;
//
// Answers are those for the triangles themselves, off by rounding in double precision: the tree leaves out none that
// matters. Every instruction set gives the same bits. A point that is not finite is near nothing.
// Nothing here allocates or needs a scratch.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <optional>

#include "prescene/collision/triangle_tree.h"

namespace prescene::collision {

struct NearestPoint {
  double distance = 0.0;                            ///< m.
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< On the triangle, m.
  std::uint32_t triangle = kNoTriangle;             ///< In the mesh; of several as near, one of them.
};

/// The nearest place whose distance from p is less than `below`, m; nothing when there is none.
std::optional<NearestPoint> nearest_point(const TriangleTree& tree, const Eigen::Vector3d& p,
                                          double below = std::numeric_limits<double>::infinity());

/// Whether nearest_point() answers; cheaper.
bool is_within(const TriangleTree& tree, const Eigen::Vector3d& p, double below);

/// How often a closed, oriented surface winds around p: 1 inside of one solid, 2 where two overlap, 0 outside, negative
/// inside of one that is turned inside out. The signed crossings of a ray: the signs of shared edges agree between
/// their triangles, so that none is missed or counted twice. Of points on the surface, either side's.
int winding_number(const TriangleTree& tree, const Eigen::Vector3d& p);

}  // namespace prescene::collision
