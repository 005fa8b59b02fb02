// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/bullet/convex_decomposition.h"

#include <hacdHACD.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "prescene/geometry/refine.h"
#include "prescene/geometry/triangle_distance.h"

namespace prescene::simulation {
namespace {

// HACD is quadratic in the triangles; a contact shape needs no more.
constexpr int kMaxTriangles = 1000;
// It looks for dents at corners only, so a big triangle hides them: edges longer than this share of the mesh's diagonal
// are halved, up to so many triangles.
constexpr double kLongestEdge = 0.1;
constexpr std::size_t kMaxRefinedTriangles = 2000;
// HACD measures concavity on data scaled to this size.
constexpr double kScale = 1000.0;

/// A mesh and its triangles' clusters, which become parts.
class PartMaker {
 public:
  /// `dent` (m): what a part may fill of the space outside.
  PartMaker(const geometry::TriangleMesh& mesh, double dent) : mesh_(mesh), dent_(dent) {}

  /// Appends the hull of a cluster, `corners` if it is given. HACD looks for dents along the triangles' normals, so a
  /// ring of triangles that face one way (the rim of a bin) seems convex to it: what fills space outside is halved.
  void add(const std::vector<std::size_t>& triangles, std::vector<Vector3d> corners,
           std::vector<geometry::TriangleMesh>& parts) const {
    if (corners.empty()) {
      for (const std::size_t i : triangles) {
        for (const std::uint32_t corner : mesh_.triangles[i]) corners.push_back(mesh_.vertices[corner]);
      }
    }
    if (!make_polytope(corners) && !thicken(triangles, corners)) return;  // slivers carry nothing
    auto hull = geometry::convex_hull(corners);
    if (!hull || !make_polytope(hull->vertices)) return;
    if (triangles.size() < 2 || !fills_outside(*hull)) {
      parts.push_back(*std::move(hull));
      return;
    }
    std::vector<std::size_t> order = triangles;
    const Vector3d size = geometry::bounding_box(*hull).sizes();
    int axis = 0;
    size.maxCoeff(&axis);
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t i, std::size_t k) { return middle(i)[axis] < middle(k)[axis]; });
    const auto half = order.begin() + static_cast<std::ptrdiff_t>(order.size() / 2);
    add({order.begin(), half}, {}, parts);
    add({half, order.end()}, {}, parts);
  }

 private:
  const Vector3d& corner(std::size_t triangle, std::size_t k) const {
    return mesh_.vertices[mesh_.triangles[triangle][k]];
  }
  Vector3d middle(std::size_t i) const { return (corner(i, 0) + corner(i, 1) + corner(i, 2)) / 3.0; }

  /// Makes triangles that lie in a plane a plate, inwards: one side of a wall is often a part of its own.
  bool thicken(const std::vector<std::size_t>& triangles, std::vector<Vector3d>& corners) const {
    Vector3d area = Vector3d::Zero();
    for (const std::size_t i : triangles) {
      area += 0.5 * (corner(i, 1) - corner(i, 0)).cross(corner(i, 2) - corner(i, 0));
    }
    if (area.norm() < 0.1 * dent_ * dent_) return false;
    const std::size_t count = corners.size();
    for (std::size_t i = 0; i < count; ++i) corners.push_back(corners[i] - dent_ * area.normalized());
    return true;
  }

  /// Whether a part holds a point that is outside of the mesh and deeper than kDeepDent dents from its surface. Looks
  /// at the middles of pairs of corners.
  bool fills_outside(const geometry::TriangleMesh& part) const {
    const std::vector<Vector3d>& v = part.vertices;
    const std::size_t pairs = v.size() * (v.size() - 1) / 2;
    const std::size_t stride = std::max<std::size_t>(1, pairs / kProbes);
    std::size_t n = 0;
    for (std::size_t i = 0; i < v.size(); ++i) {
      for (std::size_t k = 0; k < i; ++k) {
        if (n++ % stride != 0) continue;
        const Vector3d p = 0.5 * (v[i] + v[k]);
        if (far_from_surface(p, kDeepDent * dent_) && !inside(p)) return true;
      }
    }
    return false;
  }

  bool far_from_surface(const Vector3d& p, double distance) const {
    for (std::size_t i = 0; i < mesh_.triangles.size(); ++i) {
      if (geometry::squared_distance_to_triangle(p, corner(i, 0), corner(i, 1), corner(i, 2)) < distance * distance)
        return false;
    }
    return true;
  }

  /// By the winding number, which copes with small holes.
  bool inside(const Vector3d& p) const {
    double angle = 0.0;
    for (std::size_t i = 0; i < mesh_.triangles.size(); ++i) {
      const Vector3d a = corner(i, 0) - p;
      const Vector3d b = corner(i, 1) - p;
      const Vector3d c = corner(i, 2) - p;
      const double na = a.norm();
      const double nb = b.norm();
      const double nc = c.norm();
      // [Van Oosterom & Strackee 1983]
      angle += 2.0 * std::atan2(a.dot(b.cross(c)), na * nb * nc + a.dot(b) * nc + b.dot(c) * na + c.dot(a) * nb);
    }
    return angle > 2.0 * std::numbers::pi;
  }

  static constexpr std::size_t kProbes = 60;
  static constexpr double kDeepDent = 2.0;

  const geometry::TriangleMesh& mesh_;
  double dent_;
};

core::Result<std::vector<geometry::TriangleMesh>> decompose(const geometry::TriangleMesh& input,
                                                            const DecompositionSettings& settings) {
  if (const auto whole = make_polytope(input.vertices); !whole) return whole.status();
  const double diagonal = geometry::bounding_box(input).sizes().norm();
  const geometry::TriangleMesh mesh =
      geometry::refined(geometry::simplified(input, kMaxTriangles), kLongestEdge * diagonal, kMaxRefinedTriangles);
  std::vector<HACD::Vec3<HACD::Real>> points;
  points.reserve(mesh.vertices.size());
  for (const Vector3d& v : mesh.vertices) points.emplace_back(v.x(), v.y(), v.z());
  std::vector<HACD::Vec3<long>> triangles;
  triangles.reserve(mesh.triangles.size());
  for (const auto& t : mesh.triangles) {
    triangles.emplace_back(static_cast<long>(t[0]), static_cast<long>(t[1]), static_cast<long>(t[2]));
  }
  HACD::HACD hacd;
  hacd.SetPoints(points.data());
  hacd.SetNPoints(points.size());
  hacd.SetTriangles(triangles.data());
  hacd.SetNTriangles(triangles.size());
  hacd.SetScaleFactor(kScale);
  hacd.SetCompacityWeight(0.1);
  hacd.SetVolumeWeight(0.0);
  hacd.SetNClusters(static_cast<std::size_t>(std::max(1, settings.min_parts)));
  hacd.SetConcavity(settings.concavity * kScale);
  hacd.SetNVerticesPerCH(static_cast<std::size_t>(std::max(8, settings.max_part_vertices)));
  hacd.SetConnectDist(30.0);
  // Without these, dents are looked for from corners of the own part only, and thin walls fill what they surround.
  hacd.SetAddExtraDistPoints(true);
  hacd.SetAddNeighboursDistPoints(false);
  hacd.SetAddFacesPoints(false);
  if (!hacd.Compute()) {
    return core::invalid_input("convex decomposition failed; give the mesh's convex parts instead (convex_parts)");
  }
  std::vector<std::vector<std::size_t>> triangles_of(hacd.GetNClusters());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    triangles_of[static_cast<std::size_t>(hacd.GetPartition()[i])].push_back(i);
  }
  std::vector<geometry::TriangleMesh> parts;
  const PartMaker maker(mesh, settings.concavity * diagonal);
  for (std::size_t i = 0; i < hacd.GetNClusters(); ++i) {
    std::vector<HACD::Vec3<HACD::Real>> hull(hacd.GetNPointsCH(i));
    std::vector<HACD::Vec3<long>> faces(hacd.GetNTrianglesCH(i));
    hacd.GetCH(i, hull.data(), faces.data());
    std::vector<Vector3d> corners;
    for (const auto& c : hull) corners.emplace_back(c.X(), c.Y(), c.Z());
    maker.add(triangles_of[i], std::move(corners), parts);
  }
  if (parts.empty()) {
    return core::invalid_input("convex decomposition found no part with a volume; check the mesh's scale");
  }
  return parts;
}

}  // namespace

Decomposer hacd_decomposer() { return decompose; }

}  // namespace prescene::simulation
