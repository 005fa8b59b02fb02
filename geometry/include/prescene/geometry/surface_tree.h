// SPDX-License-Identifier: Apache-2.0
// The surface of a mesh for questions of nearness, and how far two surfaces are apart.
//
//   const SurfaceTree original(mesh), other(coarse);
//   const double error = surface_distance(original, other, 0.05);   // no point of either is further from the other
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

/// A bound, m: no point of `from` is further than this from `to`. It is above the largest such distance by at most
/// `tolerance` times that and 1e-4 of the size of `from`, unless it takes more than a million questions of nearness, or
/// 20 a triangle: then it may be higher. tolerance > 0 (checked).
double largest_distance(const TriangleMesh& from, const SurfaceTree& to, double tolerance);

/// The larger of both ways: a bound on the Hausdorff distance of two surfaces, m.
double surface_distance(const SurfaceTree& a, const SurfaceTree& b, double tolerance);

}  // namespace prescene::geometry
