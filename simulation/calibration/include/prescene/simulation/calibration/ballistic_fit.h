// SPDX-License-Identifier: Apache-2.0
// The state of an object in free flight from poses that were measured with noise.
#pragma once

#include <span>

#include "prescene/core/status.h"
#include "prescene/geometry/pose.h"

namespace prescene::simulation {

struct TimedPose {
  double time = 0.0;  ///< s
  geometry::Pose X_WO;
};

/// State at the last pose's time, and how well the poses fit.
struct BallisticState {
  double time = 0.0;
  geometry::Pose X_WO;
  geometry::Twist V_WO;       ///< Of O's origin, in W.
  double position_rms = 0.0;  ///< m, over all poses and coordinates.
  double rotation_rms = 0.0;  ///< rad, likewise.
};

/// Least squares: the centre of mass (p_OoOcm, m) on a parabola under `gravity_W`, turning with a constant spin in W
/// (exact for equal moments of inertia; over a tenth of a second nearly so for others). Fails with kInvalidInput for
/// fewer than three poses, times that do not ascend, or more than a quarter turn from the middle pose.
core::Result<BallisticState> fit_ballistic(std::span<const TimedPose> poses, const geometry::Vector3d& center_of_mass,
                                           const geometry::Vector3d& gravity_W);

}  // namespace prescene::simulation
