// SPDX-License-Identifier: Apache-2.0
// Triangle meshes: the one shape that everything else (hulls, trees, renderings) is made from. Lengths are metres.
// Indices of triangles must be those of vertices; only repair_mesh takes others (not checked elsewhere).
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "prescene/core/status.h"
#include "prescene/geometry/pose.h"

namespace prescene::geometry {

/// Vertices in metres in the mesh's own frame; triangles are counter-clockwise seen from outside.
struct TriangleMesh {
  std::vector<Vector3d> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;

  friend bool operator==(const TriangleMesh&, const TriangleMesh&) = default;
  bool empty() const { return triangles.empty(); }
};

/// What repair_mesh found and changed.
struct MeshRepairReport {
  int non_finite_vertices = 0;     ///< Triangles using one were dropped.
  int out_of_range_triangles = 0;  ///< Index beyond the vertices; dropped.
  int degenerate_triangles = 0;    ///< Two equal corners or (almost) no area; dropped.
  int flipped_edges = 0;       ///< Of triangles with three corners in a line, put right without opening the surface.
  int duplicate_vertices = 0;  ///< Bit-equal positions made one.
  int unused_vertices = 0;
  bool changed() const;
  std::string text() const;  ///< One line for a person; empty when nothing changed.

  friend bool operator==(const MeshRepairReport&, const MeshRepairReport&) = default;
};

/// A mesh without NaN, dangling indices, zero-area triangles, duplicate or unused vertices, with a report (may be
/// null). A surface that is closed stays closed: where welding or dropping would open it (thin scans that touch
/// themselves in a point), the duplicate vertices and zero-area triangles there are kept. Fails with kInvalidInput when
/// no triangle is left.
core::Result<TriangleMesh> repair_mesh(TriangleMesh mesh, MeshRepairReport* report);

/// How the edges of a mesh fit together: by the triangles' own indices where these make it watertight, otherwise with
/// vertices welded by position. Triangles with two equal corners don't count.
struct MeshTopology {
  int open_edges = 0;          ///< Edges with one triangle.
  int non_manifold_edges = 0;  ///< Edges with more than two.
  int inconsistent_edges = 0;  ///< Edges that both triangles run in the same direction.
  int unbalanced_edges = 0;    ///< Edges that triangles run more often in one direction than in the other.
  int components = 0;          ///< Connected over shared vertices.
  bool watertight() const { return open_edges == 0 && non_manifold_edges == 0; }
  bool oriented() const { return inconsistent_edges == 0; }
  /// The triangles enclose a volume, also where surfaces touch along an edge; watertight() && oriented() implies it.
  bool bounds_volume() const { return unbalanced_edges == 0; }
};
MeshTopology mesh_topology(const TriangleMesh& mesh);

using Box = Eigen::AlignedBox3d;
/// Of all vertices, in the mesh's frame; empty (isEmpty()) without any.
Box bounding_box(const TriangleMesh& mesh);
/// Largest distance of a vertex from `p_MQ` (mesh frame), m; 0 without vertices.
double radius_about(const TriangleMesh& mesh, const Vector3d& p_MQ);
/// m^2. Of one side: a closed surface counts once.
double surface_area(const TriangleMesh& mesh);

/// The mesh of frame M in frame N.
TriangleMesh transformed(const TriangleMesh& mesh, const Pose& X_NM);
/// All coordinates times `factor`; a negative one mirrors, and triangles are turned so that they stay outward.
TriangleMesh scaled(const TriangleMesh& mesh, double factor);
/// One mesh holding both.
TriangleMesh joined(const TriangleMesh& a, const TriangleMesh& b);
/// Connected components as mesh_topology counts them, in the order of their first triangle.
std::vector<TriangleMesh> connected_components(const TriangleMesh& mesh);
/// A coarser mesh of at most `max_triangles` (edge collapse by quadric error [Garland & Heckbert 1997], deterministic);
/// the same mesh when it is small enough already. What bounds a volume still does so; tunnels and necks that are small
/// for so few triangles close, and leave edges with four triangles where they pinch the surface. max_triangles >= 4
/// (checked).
TriangleMesh simplified(const TriangleMesh& mesh, int max_triangles);
/// The convex hull in the points' frame, its triangles outward. Fails with kInvalidInput when a point is not finite or
/// all lie in a plane.
core::Result<TriangleMesh> convex_hull(const std::vector<Vector3d>& points);

/// A point of a surface, in the mesh's frame.
struct SurfacePoint {
  Vector3d position;  ///< m
  Vector3d normal;    ///< Of its triangle, outward, of unit length.
};
/// `count` points, uniform over the surface; the same seed gives the same points. Aborts when count < 0 or the mesh has
/// no triangle.
std::vector<SurfacePoint> sample_surface(const TriangleMesh& mesh, int count, std::uint64_t seed);

/// Stable identity of the content, for caches.
std::uint64_t content_hash(const TriangleMesh& mesh);

}  // namespace prescene::geometry
