// SPDX-License-Identifier: Apache-2.0
// Hulls of smooth scans have as many vertices as the scans. To tell the faces of such a hull apart takes time with the
// square of that: minutes for 50,000 vertices.
#pragma once

#include <vector>

#include "prescene/simulation/convex_polytope.h"

namespace prescene::simulation {

/// make_polytope(), but of a hull with more than 1500 vertices only those that are the farthest out in one of 1000
/// directions, corners of its flat faces, and those without which it would be off by more than 0.2 % of the diagonal of
/// its bounding box. ConvexPolytope::left_out says by how much it is.
core::Result<ConvexPolytope> hull_of_scan(const std::vector<Vector3d>& points);

}  // namespace prescene::simulation
