// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/convex_polytope.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "prescene/geometry/triangle_mesh.h"

namespace prescene::simulation {
namespace {

// Faces within this angle (rad) are one; 1e-4 is far below any angle that matters for a contact normal and far above
// the rounding of a mesh file with six digits.
constexpr double kCoplanarAngle = 1e-4;
// Relative to the size of the shape.
constexpr double kCoplanarDistance = 1e-6;

double size_of(const std::vector<Vector3d>& points) {
  Eigen::AlignedBox3d box;
  for (const Vector3d& p : points) box.extend(p);
  return box.diagonal().norm();
}

std::vector<std::uint32_t> ordered_loop(const std::vector<Vector3d>& vertices, const Vector3d& normal, double offset,
                                        double tolerance) {
  std::vector<std::uint32_t> loop;
  Vector3d center = Vector3d::Zero();
  for (std::uint32_t i = 0; i < vertices.size(); ++i) {
    if (std::abs(normal.dot(vertices[i]) - offset) > tolerance) continue;
    loop.push_back(i);
    center += vertices[i];
  }
  if (loop.empty()) return loop;
  center /= static_cast<double>(loop.size());
  const Vector3d u = (vertices[loop[0]] - center).normalized();
  const Vector3d v = normal.cross(u);
  std::vector<std::pair<double, std::uint32_t>> by_angle;
  by_angle.reserve(loop.size());
  for (const std::uint32_t i : loop) {
    const Vector3d d = vertices[i] - center;
    by_angle.emplace_back(std::atan2(v.dot(d), u.dot(d)), i);
  }
  std::sort(by_angle.begin(), by_angle.end());
  for (std::size_t i = 0; i < loop.size(); ++i) loop[i] = by_angle[i].second;
  return loop;
}

}  // namespace

Vector3d ConvexPolytope::vertex_mean() const {
  Vector3d mean = Vector3d::Zero();
  for (const Vector3d& p : vertices) mean += p;
  return mean / static_cast<double>(vertices.size());
}

double ConvexPolytope::inner_radius() const {
  const Vector3d center = vertex_mean();
  double radius = std::numeric_limits<double>::infinity();
  for (const Face& face : faces) radius = std::min(radius, face.offset - face.normal.dot(center));
  return radius;
}

core::Result<ConvexPolytope> make_polytope(const std::vector<Vector3d>& points) {
  PRESCENE_TRY(const auto hull, geometry::convex_hull(points));
  ConvexPolytope polytope;
  polytope.vertices = hull.vertices;
  const double tolerance = kCoplanarDistance * size_of(hull.vertices);

  // Larger triangles give the better plane: they go first.
  struct Candidate {
    double area;
    std::size_t index;
    Vector3d normal;
  };
  std::vector<Candidate> candidates;
  for (std::size_t i = 0; i < hull.triangles.size(); ++i) {
    const auto& t = hull.triangles[i];
    const Vector3d n = (hull.vertices[t[1]] - hull.vertices[t[0]]).cross(hull.vertices[t[2]] - hull.vertices[t[0]]);
    const double area = n.norm();
    if (area > 0.0) candidates.push_back({area, i, n / area});
  }
  std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
    return a.area != b.area ? a.area > b.area : a.index < b.index;
  });
  for (const Candidate& candidate : candidates) {
    const double offset = candidate.normal.dot(hull.vertices[hull.triangles[candidate.index][0]]);
    const bool known = std::any_of(polytope.faces.begin(), polytope.faces.end(), [&](const ConvexPolytope::Face& f) {
      return f.normal.cross(candidate.normal).norm() < kCoplanarAngle && f.normal.dot(candidate.normal) > 0.0 &&
             std::abs(f.offset - offset) < 10.0 * tolerance;
    });
    if (known) continue;
    ConvexPolytope::Face face{candidate.normal, offset, {}};
    face.loop = ordered_loop(polytope.vertices, face.normal, face.offset, tolerance);
    if (face.loop.size() >= 3) polytope.faces.push_back(std::move(face));
  }
  if (polytope.faces.size() < 4 || !(polytope.inner_radius() > 0.0)) {
    return core::invalid_input("convex hull: the points lie (almost) in a plane; give the shape a thickness");
  }
  return polytope;
}

std::optional<ConvexPolytope> inset(const ConvexPolytope& polytope, double distance) {
  const Vector3d center = polytope.vertex_mean();
  std::vector<Vector3d> dual;
  dual.reserve(polytope.faces.size());
  for (const ConvexPolytope::Face& face : polytope.faces) {
    const double height = face.offset - distance - face.normal.dot(center);
    if (!(height > 0.0)) return std::nullopt;
    dual.push_back(face.normal / height);
  }
  // Facets of the dual's hull are the vertices of the intersection of half spaces.
  const core::Result<geometry::TriangleMesh> hull = geometry::convex_hull(dual);
  if (!hull) return std::nullopt;
  std::vector<Vector3d> vertices;
  const double merge = 1e-9 * size_of(polytope.vertices);
  for (const auto& t : hull->triangles) {
    geometry::Matrix3d planes;
    Vector3d offsets;
    for (int k = 0; k < 3; ++k) {
      const Vector3d& y = hull->vertices[t[static_cast<std::size_t>(k)]];
      const double height = 1.0 / y.norm();
      planes.row(k) = (y * height).transpose();
      offsets[k] = height;
    }
    const Eigen::FullPivLU<geometry::Matrix3d> lu(planes);
    if (!lu.isInvertible()) continue;
    const Vector3d vertex = center + lu.solve(offsets);
    const bool known =
        std::any_of(vertices.begin(), vertices.end(), [&](const Vector3d& v) { return (v - vertex).norm() < merge; });
    if (!known) vertices.push_back(vertex);
  }
  core::Result<ConvexPolytope> result = make_polytope(vertices);
  if (!result) return std::nullopt;
  return std::move(*result);
}

}  // namespace prescene::simulation
