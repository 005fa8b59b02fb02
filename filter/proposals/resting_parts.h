// SPDX-License-Identifier: Apache-2.0
// What the sources of resting_starts.h have in common. Frame U has z up.
#pragma once

#include <Eigen/Core>

#include "prescene/geometry/dense_solvers.h"
#include "prescene/geometry/pose.h"

namespace prescene::filter {

/// m; faces and supports that differ by less are one.
inline constexpr double kSameHeight = 0.01;

inline Eigen::Vector2d left_of(const Eigen::Vector2d& v) { return {-v.y(), v.x()}; }
/// Turns so that `up` becomes z.
inline geometry::Quaterniond up_to_z(const geometry::Vector3d& up) {
  return geometry::rotation_between(up, geometry::Vector3d::UnitZ());
}

}  // namespace prescene::filter
