// SPDX-License-Identifier: Apache-2.0
#include "scan_hull.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <set>
#include <utility>

#include "prescene/geometry/triangle_mesh.h"

namespace prescene::simulation {
namespace {

using geometry::TriangleMesh;

constexpr std::size_t kMostOfScan = 1500;
constexpr int kDirections = 1000;
constexpr double kMostLeftOut = 0.002;  // of the bounding box's diagonal
// Flat faces that are kept: those of the largest triangles of the hull.
constexpr std::size_t kFlatFaces = 64;
constexpr int kCornersOfFlat = 32;
constexpr double kFlatDistance = 1e-6;  // of the scan's size, as in make_polytope
constexpr double kSameNormal = 1e-8;    // of 1 - cosine

/// The one that is the farthest out in a direction.
std::uint32_t farthest_out(const std::vector<Vector3d>& vertices, const Vector3d& direction) {
  std::uint32_t best = 0;
  double height = -std::numeric_limits<double>::infinity();
  for (std::uint32_t i = 0; i < vertices.size(); ++i) {
    const double h = direction.dot(vertices[i]);
    if (h > height) height = h, best = i;
  }
  return best;
}

void add_corners_of(const TriangleMesh& hull, const Vector3d& normal, double tolerance,
                    std::set<std::uint32_t>& chosen) {
  const double top = normal.dot(hull.vertices[farthest_out(hull.vertices, normal)]);
  std::vector<std::uint32_t> of_face;
  std::vector<Vector3d> corners;
  for (std::uint32_t i = 0; i < hull.vertices.size(); ++i)
    if (normal.dot(hull.vertices[i]) > top - tolerance) of_face.push_back(i), corners.push_back(hull.vertices[i]);
  const Vector3d u = normal.unitOrthogonal(), v = normal.cross(u);
  for (int k = 0; k < kCornersOfFlat; ++k) {
    const double angle = 2.0 * std::numbers::pi * k / kCornersOfFlat;
    chosen.insert(of_face[farthest_out(corners, std::cos(angle) * u + std::sin(angle) * v)]);
  }
}

void add_flat_faces(const TriangleMesh& hull, std::set<std::uint32_t>& chosen) {
  std::vector<std::pair<double, Vector3d>> sides;  // twice the area, normal
  for (const auto& t : hull.triangles) {
    const Vector3d twice = (hull.vertices[t[1]] - hull.vertices[t[0]]).cross(hull.vertices[t[2]] - hull.vertices[t[0]]);
    if (const double area = twice.norm(); area > 0.0) sides.emplace_back(area, twice / area);
  }
  std::stable_sort(sides.begin(), sides.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  const double tolerance = kFlatDistance * geometry::bounding_box(hull).diagonal().norm();
  std::vector<Vector3d> normals;
  for (const auto& side : sides) {
    if (normals.size() >= kFlatFaces) break;
    const Vector3d& normal = side.second;
    if (std::any_of(normals.begin(), normals.end(),
                    [&](const Vector3d& n) { return n.dot(normal) > 1.0 - kSameNormal; }))
      continue;
    normals.push_back(normal);
    add_corners_of(hull, normal, tolerance, chosen);
  }
}

}  // namespace

core::Result<ConvexPolytope> hull_of_scan(const std::vector<Vector3d>& points) {
  if (points.size() <= kMostOfScan) return make_polytope(points);
  PRESCENE_TRY(const TriangleMesh hull, geometry::convex_hull(points));
  if (hull.vertices.size() <= kMostOfScan) return make_polytope(points);
  const geometry::Box box = geometry::bounding_box(hull);
  std::set<std::uint32_t> chosen;
  for (int k = 0; k < kDirections; ++k) {  // evenly over the sphere, on a spiral, of the hull scaled to a cube
    const double z = 1.0 - (2.0 * k + 1.0) / kDirections, across = std::sqrt(1.0 - z * z);
    const double angle = std::numbers::pi * (3.0 - std::sqrt(5.0)) * k;
    const Vector3d direction(across * std::cos(angle), across * std::sin(angle), z);
    chosen.insert(farthest_out(hull.vertices, direction.cwiseQuotient(box.sizes())));
  }
  add_flat_faces(hull, chosen);
  const double most = kMostLeftOut * box.diagonal().norm();
  for (;;) {
    std::vector<Vector3d> kept;
    kept.reserve(chosen.size());
    for (const std::uint32_t i : chosen) kept.push_back(hull.vertices[i]);
    PRESCENE_TRY(ConvexPolytope polytope, make_polytope(kept));
    const std::size_t before = chosen.size();
    for (const ConvexPolytope::Face& face : polytope.faces) {
      const std::uint32_t farthest = farthest_out(hull.vertices, face.normal);
      const double height = face.normal.dot(hull.vertices[farthest]) - face.offset;
      if (height > most) chosen.insert(farthest);
      polytope.left_out = std::max(polytope.left_out, height);
    }
    if (chosen.size() == before) return polytope;
  }
}

}  // namespace prescene::simulation
