// SPDX-License-Identifier: Apache-2.0
#include "prescene/geometry/triangle_distance.h"

#include <algorithm>
#include <array>

namespace prescene::geometry {

PlaceInTriangle nearest_in_triangle(const Vector3d& p, const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const Vector3d normal = (b - a).cross(c - a);
  const double of_c = normal.dot((b - a).cross(p - a));
  const double of_a = normal.dot((c - b).cross(p - b));
  const double of_b = normal.dot((a - c).cross(p - c));
  const double square = normal.squaredNorm();
  if (of_a >= 0.0 && of_b >= 0.0 && of_c >= 0.0 && square > 0.0) {
    const double height = normal.dot(p - a);
    return {Vector3d(of_a, of_b, of_c) / (of_a + of_b + of_c), height * height / square};
  }
  const std::array<const Vector3d*, 3> corners = {&a, &b, &c};
  PlaceInTriangle nearest;
  for (Eigen::Index k = 0; k < 3; ++k) {
    const Eigen::Index next = (k + 1) % 3;
    const Vector3d& from = *corners[static_cast<std::size_t>(k)];
    const Vector3d along = *corners[static_cast<std::size_t>(next)] - from;
    const double length = along.squaredNorm();
    const double t = length > 0.0 ? std::clamp(along.dot(p - from) / length, 0.0, 1.0) : 0.0;
    const double squared = (p - from - t * along).squaredNorm();
    if (k > 0 && !(squared < nearest.squared_distance)) continue;
    nearest.squared_distance = squared;
    nearest.weights.setZero();
    nearest.weights[k] = 1.0 - t;
    nearest.weights[next] += t;
  }
  return nearest;
}

}  // namespace prescene::geometry
