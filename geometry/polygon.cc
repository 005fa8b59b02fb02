// SPDX-License-Identifier: Apache-2.0
#include "prescene/geometry/polygon.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "prescene/core/check.h"

namespace prescene::geometry {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

double cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

/// > 0 where `c` is to the left of the line from `a` to `b`.
double turn(const Vector2d& a, const Vector2d& b, const Vector2d& c) { return cross(b - a, c - a); }

}  // namespace

std::size_t convex_polygon(std::span<Vector2d> points, std::span<Vector2d> corners) {
  if (points.empty()) return 0;
  PRESCENE_DCHECK(corners.size() >= 2 * points.size());
  std::sort(points.begin(), points.end(),
            [](const Vector2d& a, const Vector2d& b) { return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y(); });
  std::size_t count = 0;
  const auto extend = [&](const Vector2d& p, std::size_t first) {
    while (count >= first + 2 && turn(corners[count - 2], corners[count - 1], p) <= 0.0) --count;
    corners[count++] = p;
  };
  // The lower chain from left to right, then the upper one back.
  for (const Vector2d& p : points) extend(p, 0);
  const std::size_t rightmost = count - 1;
  for (std::size_t i = points.size() - 1; i-- > 0;) extend(points[i], rightmost);
  // The first point has come again; coincident points have left nothing but it.
  if (count > 1) --count;
  if (count == 2 && corners[0] == corners[1]) count = 1;
  return count;
}

std::vector<Vector2d> convex_polygon(std::vector<Vector2d> points) {
  std::vector<Vector2d> corners(2 * points.size());
  corners.resize(convex_polygon(std::span(points), std::span(corners)));
  return corners;
}

double distance_inside(std::span<const Vector2d> corners, const Vector2d& p) {
  if (corners.size() < 3) return -kInfinity;
  double least = kInfinity;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vector2d& a = corners[i];
    const Vector2d& b = corners[(i + 1) % corners.size()];
    least = std::min(least, turn(a, b, p) / (b - a).norm());
  }
  return least;
}

double distance_outside(std::span<const Vector2d> corners, const Vector2d& p) {
  if (corners.empty()) return kInfinity;
  if (corners.size() == 1) return (p - corners[0]).norm();
  double least = kInfinity;
  bool outside = corners.size() == 2;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vector2d& a = corners[i];
    const Vector2d along = corners[(i + 1) % corners.size()] - a;
    outside = outside || cross(along, p - a) < 0.0;
    const double at = std::clamp(along.dot(p - a) / along.squaredNorm(), 0.0, 1.0);
    least = std::min(least, (p - a - at * along).squaredNorm());
  }
  return outside ? std::sqrt(least) : 0.0;
}

}  // namespace prescene::geometry
