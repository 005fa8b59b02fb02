// SPDX-License-Identifier: Apache-2.0
#include "tests/support/brute_force.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "prescene/collision/exact_triangles.h"
#include "prescene/geometry/triangle_distance.h"

namespace prescene::tests {
namespace {

using collision::Mesh;
using collision::Transform;
using collision::Triangle;
using Eigen::Vector3d;
using Eigen::Vector3f;
using Box = Eigen::AlignedBox3f;

struct BoxedTriangle {
  Triangle corners;
  Box box;
};

std::vector<BoxedTriangle> boxed_triangles(const Mesh& mesh, const std::vector<Vector3f>& vertices) {
  std::vector<BoxedTriangle> triangles;
  triangles.reserve(mesh.triangle_count());
  for (const collision::TriangleIndices& t : mesh.triangles()) {
    BoxedTriangle triangle{{vertices[t[0]], vertices[t[1]], vertices[t[2]]}, Box()};
    for (const Vector3f& corner : triangle.corners) triangle.box.extend(corner);
    triangles.push_back(triangle);
  }
  return triangles;
}

Box box_of(const std::vector<BoxedTriangle>& triangles) {
  Box box;
  for (const BoxedTriangle& triangle : triangles) box.extend(triangle.box);
  return box;
}

/// Grown by `margin` and a little, so that rounding never takes anything away; unchanged for no margin.
Box grown(const Box& box, float margin) {
  if (margin == 0.0F) return box;
  const float far = std::max(box.min().cwiseAbs().maxCoeff(), box.max().cwiseAbs().maxCoeff());
  const Vector3f by = Vector3f::Constant(margin * 1.00001F + far * 1e-6F);
  return Box(box.min() - by, box.max() + by);
}

/// Calls visit(a, b) for all pairs whose boxes, A's grown by `margin`, meet; until visit returns true.
template <class Visit>
bool visit_pairs(const Mesh& mesh_a, const Mesh& mesh_b, const Transform& X_AB, float margin, const Visit& visit) {
  std::vector<Vector3f> moved;
  moved.reserve(mesh_b.vertices().size());
  for (const Vector3f& vertex : mesh_b.vertices()) moved.push_back(X_AB * vertex);
  std::vector<BoxedTriangle> a = boxed_triangles(mesh_a, mesh_a.vertices()), b = boxed_triangles(mesh_b, moved);
  for (BoxedTriangle& triangle : a) triangle.box = grown(triangle.box, margin);
  const Box box_a = box_of(a), box_b = box_of(b);
  std::erase_if(a, [&](const BoxedTriangle& triangle) { return !triangle.box.intersects(box_b); });
  std::erase_if(b, [&](const BoxedTriangle& triangle) { return !triangle.box.intersects(box_a); });

  // A sweep along the axis in which what is left is longest.
  Eigen::Index axis = 0;
  box_of(a).intersection(box_of(b)).sizes().maxCoeff(&axis);
  const auto by_low = [axis](const BoxedTriangle& p, const BoxedTriangle& q) {
    return p.box.min()[axis] < q.box.min()[axis];
  };
  std::sort(a.begin(), a.end(), by_low);
  std::sort(b.begin(), b.end(), by_low);
  std::vector<const BoxedTriangle*> open;  // of B, begun and not yet ended
  auto next = b.begin();
  for (const BoxedTriangle& triangle : a) {
    for (; next != b.end() && next->box.min()[axis] <= triangle.box.max()[axis]; ++next) open.push_back(&*next);
    std::erase_if(open, [&](const BoxedTriangle* other) { return other->box.max()[axis] < triangle.box.min()[axis]; });
    for (const BoxedTriangle* other : open)
      if (triangle.box.intersects(other->box) && visit(triangle.corners, other->corners)) return true;
  }
  return false;
}

double squared_distance_of_segments(const Vector3d& p0, const Vector3d& p1, const Vector3d& q0, const Vector3d& q1) {
  const Vector3d u = p1 - p0, v = q1 - q0, w = p0 - q0;
  const double uu = u.squaredNorm(), uv = u.dot(v), vv = v.squaredNorm(), uw = u.dot(w), vw = v.dot(w);
  const double determinant = uu * vv - uv * uv;
  // The smallest of: both inside (if not parallel), and each end with the other segment.
  double best = std::min({w.squaredNorm(), (p0 - q1).squaredNorm(), (p1 - q0).squaredNorm(), (p1 - q1).squaredNorm()});
  const auto at = [&](double s, double t) {
    best = std::min(best, (w + std::clamp(s, 0.0, 1.0) * u - std::clamp(t, 0.0, 1.0) * v).squaredNorm());
  };
  if (determinant > 0.0) {
    const double s = (uv * vw - vv * uw) / determinant, t = (uu * vw - uv * uw) / determinant;
    if (s >= 0.0 && s <= 1.0 && t >= 0.0 && t <= 1.0) at(s, t);
  }
  if (vv > 0.0) {
    at(0.0, vw / vv);
    at(1.0, (vw + uv) / vv);
  }
  if (uu > 0.0) {
    at(-uw / uu, 0.0);
    at((uv - uw) / uu, 1.0);
  }
  return best;
}

double squared_distance(const Triangle& a, const Triangle& b) {
  std::array<Vector3d, 3> p, q;
  for (std::size_t i = 0; i < 3; ++i) {
    p[i] = a[i].cast<double>();
    q[i] = b[i].cast<double>();
  }
  double best = geometry::squared_distance_to_triangle(p[0], q[0], q[1], q[2]);
  for (std::size_t i = 0; i < 3; ++i) {
    best = std::min(best, geometry::squared_distance_to_triangle(p[i], q[0], q[1], q[2]));
    best = std::min(best, geometry::squared_distance_to_triangle(q[i], p[0], p[1], p[2]));
    for (std::size_t j = 0; j < 3; ++j)
      best = std::min(best, squared_distance_of_segments(p[i], p[(i + 1) % 3], q[j], q[(j + 1) % 3]));
  }
  return best;
}

}  // namespace

bool collide_by_brute_force(const Mesh& a, const Mesh& b, const Transform& X_AB) {
  return visit_pairs(a, b, X_AB, 0.0F,
                     [](const Triangle& p, const Triangle& q) { return collision::triangles_intersect(p, q); });
}

double distance_by_brute_force(const Mesh& a, const Mesh& b, const Transform& X_AB, double limit) {
  if (collide_by_brute_force(a, b, X_AB)) return 0.0;
  double best = limit * limit;
  visit_pairs(a, b, X_AB, std::nextafter(static_cast<float>(limit), HUGE_VALF),
              [&](const Triangle& p, const Triangle& q) {
                best = std::min(best, squared_distance(p, q));
                return false;
              });
  return std::sqrt(best);
}

}  // namespace prescene::tests
