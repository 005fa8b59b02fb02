// SPDX-License-Identifier: Apache-2.0
#include "swept_sphere.h"

#include <algorithm>
#include <cmath>

#include "prescene/collision/spheres/continuous_sphere_queries.h"
#include "surface_search.h"

namespace prescene::collision {

using Eigen::Vector3d;

double SweptSphere::meets_segment(const Vector3d& a, const Vector3d& b) const {
  // What the centre must not enter is a capsule: a cylinder and the spheres at its ends.
  const Vector3d segment = b - a;
  const double length = segment.norm();
  if (length > 0.0) {
    const Vector3d along = segment / length;
    const auto across = [&](const Vector3d& v) { return Vector3d(v - v.dot(along) * along); };
    const auto t = swept_spheres_contact(across(from - a), across(to - a), radius);
    if (!t) return kNever;
    const double place = along.dot(from + *t * move - a);
    if (place >= 0.0 && place <= length) return *t;
  }
  return std::min(swept_spheres_contact(from - a, to - a, radius).value_or(kNever),
                  swept_spheres_contact(from - b, to - b, radius).value_or(kNever));
}

double SweptSphere::meets_triangle(const Vector3d& a, const Vector3d& b, const Vector3d& c) const {
  if ((nearest_on_triangle(from, a, b, c) - from).squaredNorm() <= radius * radius) return 0.0;
  const Vector3d normal = (b - a).cross(c - a);
  const double length = normal.norm();
  if (length > 0.0) {
    const double start = normal.dot(from - a) / length;
    const double end = normal.dot(to - a) / length;
    const double gap = std::abs(start) - radius;
    const double gap_at_end = (start < 0.0 ? -end : end) - radius;
    if (gap > 0.0 && gap_at_end > 0.0) return kNever;
    if (gap > 0.0) {
      const double t = gap / (gap - gap_at_end);
      const Vector3d p = from + t * move;
      if (normal.dot((b - a).cross(p - a)) >= 0.0 && normal.dot((c - b).cross(p - b)) >= 0.0 &&
          normal.dot((a - c).cross(p - c)) >= 0.0)
        return t;
    }
  }
  return std::min({meets_segment(a, b), meets_segment(b, c), meets_segment(c, a)});
}

double SweptSphere::enters(const Eigen::AlignedBox3d& box) const {
  double enter = 0.0;
  double leave = 1.0;
  for (int k = 0; k < 3; ++k) {
    const double low = box.min()[k] - reach - from[k];
    const double high = box.max()[k] + reach - from[k];
    if (move[k] == 0.0) {
      if (low > 0.0 || high < 0.0) return kNever;
      continue;
    }
    const double to_low = low / move[k];
    const double to_high = high / move[k];
    enter = std::max(enter, std::min(to_low, to_high));
    leave = std::min(leave, std::max(to_low, to_high));
  }
  return enter <= leave ? enter : kNever;
}

}  // namespace prescene::collision
