// SPDX-License-Identifier: Apache-2.0
#include "prescene/geometry/triangle_distance.h"

#include <algorithm>

namespace prescene::geometry {

double squared_distance_to_triangle(const Vector3d& p, const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const Vector3d normal = (b - a).cross(c - a);
  const bool above = normal.dot((b - a).cross(p - a)) >= 0.0 && normal.dot((c - b).cross(p - b)) >= 0.0 &&
                     normal.dot((a - c).cross(p - c)) >= 0.0;
  if (above && normal.squaredNorm() > 0.0) {
    const double height = normal.dot(p - a);
    return height * height / normal.squaredNorm();
  }
  const auto to_edge = [&](const Vector3d& from, const Vector3d& to) {
    const Vector3d along = to - from;
    const double length = along.squaredNorm();
    const double t = length > 0.0 ? std::clamp(along.dot(p - from) / length, 0.0, 1.0) : 0.0;
    return (p - from - t * along).squaredNorm();
  };
  return std::min({to_edge(a, b), to_edge(b, c), to_edge(c, a)});
}

}  // namespace prescene::geometry
