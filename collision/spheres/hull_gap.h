// SPDX-License-Identifier: Apache-2.0
// How far a point is from the convex hull of spheres.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "prescene/collision/spheres/sphere_packing.h"

namespace prescene::collision {

/// Bounds of the distance of p from the convex hull of the spheres, m.
struct HullGap {
  double low = 0.0;
  double high = 0.0;
};
/// Until the bounds agree within a millionth of the spheres' extent, or, with `decide` (m), the distance is known to be
/// at most that or more than it [Gilbert et al. 1988]. At least one sphere (checked).
HullGap hull_gap(const Eigen::Vector3d& p, std::span<const PackedSphere> spheres,
                 std::optional<double> decide = std::nullopt);

}  // namespace prescene::collision
