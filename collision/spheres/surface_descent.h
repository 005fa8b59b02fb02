// SPDX-License-Identifier: Apache-2.0
// What static shapes ask the tree over their triangles besides the nearest place: when a sphere that moves touches it,
// and how far it reaches.
#pragma once

#include <Eigen/Core>

#include "prescene/collision/triangle_tree.h"
#include "swept_sphere.h"

namespace prescene::collision {

/// When the sphere first touches a triangle; SweptSphere::kNever when it does not. No allocation.
double first_contact(const TriangleTree& tree, const SweptSphere& sphere);

/// The largest direction . p over the corners of triangles within `radius` of `centre`; minus infinity when there are
/// none. No allocation.
double reach_along(const TriangleTree& tree, const Eigen::Vector3d& direction, const Eigen::Vector3d& centre,
                   double radius);

}  // namespace prescene::collision
