// SPDX-License-Identifier: Apache-2.0
#include "surface_search.h"

#include <algorithm>
#include <cmath>

#include "prescene/core/check.h"

namespace prescene::collision {
namespace {

using Eigen::Vector3d;

Vector3d nearest_on_segment(const Vector3d& p, const Vector3d& from, const Vector3d& to) {
  const Vector3d along = to - from;
  const double length = along.squaredNorm();
  const double t = length > 0.0 ? std::clamp(along.dot(p - from) / length, 0.0, 1.0) : 0.0;
  return from + t * along;
}

}  // namespace

Vector3d nearest_on_triangle(const Vector3d& p, const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const Vector3d normal = (b - a).cross(c - a);
  const double squared = normal.squaredNorm();
  if (squared > 0.0 && normal.dot((b - a).cross(p - a)) >= 0.0 && normal.dot((c - b).cross(p - b)) >= 0.0 &&
      normal.dot((a - c).cross(p - c)) >= 0.0) {
    return p - normal * (normal.dot(p - a) / squared);
  }
  Vector3d nearest = nearest_on_segment(p, a, b);
  for (const Vector3d& point : {nearest_on_segment(p, b, c), nearest_on_segment(p, c, a)}) {
    if ((point - p).squaredNorm() < (nearest - p).squaredNorm()) nearest = point;
  }
  return nearest;
}

SurfaceSearch::SurfaceSearch(std::span<const Vector3f> vertices, std::span<const TriangleIndices> triangles)
    : tree_([&] {
        auto mesh = Mesh::make({vertices.begin(), vertices.end()}, {triangles.begin(), triangles.end()}, "surface");
        PRESCENE_CHECK(mesh.ok());
        core::ThreadPool pool(1);
        return TriangleTree::build(*mesh, {}, pool);
      }()) {
  for (const TriangleIndices& triangle : triangles) {
    for (const std::uint32_t v : triangle) box_.extend(vertices[v].cast<double>());
  }
}

SurfaceSearch::Nearest SurfaceSearch::nearest(const Vector3d& q, double bound) const {
  const auto found = nearest_point(tree_, q, std::sqrt(bound));
  if (!found) return {bound, kNone, Vector3d::Zero()};
  return {found->distance * found->distance, found->triangle, found->point};
}

}  // namespace prescene::collision
