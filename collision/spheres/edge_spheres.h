// SPDX-License-Identifier: Apache-2.0
// Spheres in the corners of a body, so that the convex hull of its packing comes near enough to its own.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "surface_search.h"
#include "void_search.h"

namespace prescene::collision {

struct EdgeResult {
  int placed = 0;
  /// A corner that no sphere could be placed for: the body is thinner there than the smallest radius.
  std::optional<Eigen::Vector3d> too_thin;
  /// Corners that are still too far from the hull because there are no spheres left for them.
  std::size_t unserved = 0;
};

/// The corners of the convex hull of the triangles, m.
std::vector<Eigen::Vector3d> hull_corners(const std::vector<Vector3f>& vertices,
                                          const std::vector<TriangleIndices>& triangles);

/// Places spheres until no corner is further than `fidelity` (m) from the convex hull of all spheres, or there are
/// `max_spheres`. There is at least one sphere already (checked).
EdgeResult place_edge_spheres(VoidSearch& voids, const SurfaceSearch& surface,
                              const std::vector<Eigen::Vector3d>& corners, double fidelity, double smallest,
                              std::size_t max_spheres, core::ThreadPool& pool);

}  // namespace prescene::collision
