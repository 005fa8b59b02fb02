// SPDX-License-Identifier: Apache-2.0
// Convex polyhedra with their faces as polygons: what contact finding needs of a hull.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "prescene/core/status.h"
#include "prescene/geometry/pose.h"

namespace prescene::simulation {

using geometry::Vector3d;

/// A bounded convex polyhedron. Coplanar triangles of its hull are one face.
struct ConvexPolytope {
  struct Face {
    Vector3d normal;                  ///< Unit, outward.
    double offset = 0.0;              ///< m; inside is normal.p <= offset.
    std::vector<std::uint32_t> loop;  ///< Vertices, counter-clockwise seen from outside.
  };
  std::vector<Vector3d> vertices;  ///< m
  std::vector<Face> faces;
  double left_out = 0.0;  ///< m: how far the hull that it stands for reaches beyond it; 0 = it is that hull.

  Vector3d vertex_mean() const;
  /// Distance from the mean of the vertices to the nearest face plane, m: a lower bound of the inscribed sphere's
  /// radius.
  double inner_radius() const;
};

/// The convex hull of points. Fails with kInvalidInput when they (almost) lie in a plane.
core::Result<ConvexPolytope> make_polytope(const std::vector<Vector3d>& points);

/// All face planes moved inwards by `distance` (m): the points whose ball of that radius fits inside. Faces that vanish
/// are dropped. Empty when distance is not below inner_radius().
std::optional<ConvexPolytope> inset(const ConvexPolytope& polytope, double distance);

}  // namespace prescene::simulation
