// SPDX-License-Identifier: Apache-2.0
// What a body stands on.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace prescene::simulation {

/// The convex hull of at most kMost points of a plane.
template <std::size_t kMost>
class SupportPolygon {
 public:
  void add(const Eigen::Vector2d& p) {
    std::size_t at = points_count_++;
    for (; at > 0 && is_left(p, points_[at - 1]); --at) points_[at] = points_[at - 1];
    points_[at] = p;
    // Counter-clockwise: the lower chain from left to right, then the upper one back [Andrew 1979].
    std::array<Eigen::Vector2d, 2 * kMost> hull;
    std::size_t n = 0;
    const auto extend = [&](const Eigen::Vector2d& q, std::size_t fixed) {
      while (n >= fixed + 2 && cross(hull[n - 1] - hull[n - 2], q - hull[n - 2]) <= 0.0) --n;
      hull[n++] = q;
    };
    for (std::size_t i = 0; i < points_count_; ++i) extend(points_[i], 0);
    const std::size_t lower = n - 1;
    for (std::size_t i = points_count_ - 1; i-- > 0;) extend(points_[i], lower);
    count_ = std::max<std::size_t>(1, n - 1);
    std::copy_n(hull.begin(), count_, corners_.begin());
  }

  /// How far outside a point is, 0 inside.
  double distance(const Eigen::Vector2d& p) const {
    if (count_ == 1) return (p - corners_[0]).norm();
    double least = std::numeric_limits<double>::infinity();
    bool outside = count_ == 2;
    for (std::size_t i = 0; i < count_; ++i) {
      const Eigen::Vector2d& a = corners_[i];
      const Eigen::Vector2d along = corners_[(i + 1) % count_] - a;
      outside = outside || cross(along, p - a) < 0.0;
      const double at = std::clamp(along.dot(p - a) / along.squaredNorm(), 0.0, 1.0);
      least = std::min(least, (p - a - at * along).squaredNorm());
    }
    return outside ? std::sqrt(least) : 0.0;
  }

 private:
  static bool is_left(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y());
  }
  static double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

  std::array<Eigen::Vector2d, kMost> points_;  // from left to right
  std::size_t points_count_ = 0;
  std::array<Eigen::Vector2d, kMost> corners_;
  std::size_t count_ = 0;
};

}  // namespace prescene::simulation
