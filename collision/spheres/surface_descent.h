// SPDX-License-Identifier: Apache-2.0
// What static shapes ask the tree over their triangles besides the nearest place: when a sphere that moves touches it,
// and how far it reaches.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "prescene/collision/triangle_tree.h"
#include "swept_sphere.h"

namespace prescene::collision {

/// When the sphere first touches a triangle; SweptSphere::kNever when it does not. No allocation.
double first_contact(const TriangleTree& tree, const SweptSphere& sphere);

/// The largest direction . p over the corners of triangles within `radius` of `centre`; minus infinity when there are
/// none. No allocation.
double reach_along(const TriangleTree& tree, const Eigen::Vector3d& direction, const Eigen::Vector3d& centre,
                   double radius);

/// Edges of the mesh's triangles, a bit for each from corner k to the next, that are not shared with just one other
/// triangle that passes them the other way round.
std::vector<std::uint8_t> find_rims(const Mesh& mesh);

/// See StaticShape::is_flat_about. No allocation.
bool is_flat_about(const TriangleTree& tree, std::span<const std::uint8_t> rims, const Eigen::Vector3d& place,
                   const Eigen::Vector3d& normal, double radius, double slack);

}  // namespace prescene::collision
