// SPDX-License-Identifier: Apache-2.0
// The surface of a mesh for questions of nearness.
//
//   const SurfaceTree tree(mesh);
//   const double distance = std::sqrt(tree.nearest(p).place.squared_distance);
#pragma once

#include <cstdint>
#include <memory>

#include "prescene/geometry/triangle_distance.h"
#include "prescene/geometry/triangle_mesh.h"

namespace prescene::geometry {

/// Immutable; any number of threads may ask. (Bodies that collide have trees of their own, in the module collision.)
class SurfaceTree {
 public:
  /// Keeps a reference to the mesh, which has at least one triangle (checked) and finite vertices.
  explicit SurfaceTree(const TriangleMesh& mesh);
  ~SurfaceTree();
  SurfaceTree(SurfaceTree&&) noexcept;

  const TriangleMesh& mesh() const { return *mesh_; }

  struct Nearest {
    std::uint32_t triangle = 0;
    PlaceInTriangle place;
  };
  /// The nearest place; of several as near always the same one. Faster the nearer the triangle `hint` is.
  Nearest nearest(const Vector3d& p, std::uint32_t hint = 0) const;
  /// Whether some place is at most `distance` away, m.
  bool is_within(const Vector3d& p, double distance) const;

  /// Of a triangle of the mesh to a point.
  PlaceInTriangle place_in(std::uint32_t triangle, const Vector3d& p) const;

 private:
  struct Tree;
  const TriangleMesh* mesh_;
  std::unique_ptr<const Tree> tree_;
};

}  // namespace prescene::geometry
