// SPDX-License-Identifier: Apache-2.0
// The state of an object that slides on a support from poses that were measured with noise.
#pragma once

#include <span>

#include "prescene/core/status.h"
#include "prescene/simulation/calibration/ballistic_fit.h"

namespace prescene::simulation {

struct SlidingState {
  BallisticState state;                                         ///< At the last pose's time; residuals likewise.
  geometry::Vector3d direction_W = geometry::Vector3d::Zero();  ///< Of the mean velocity; zero where it stands still.
  geometry::Vector3d turn_axis_W = geometry::Vector3d::Zero();  ///< Of the mean spin, likewise.
};

/// Least squares: O's origin slows down (or gains) at a constant rate along its mean velocity and keeps its velocity
/// across it; turning likewise about the mean spin. Fails with kInvalidInput for fewer than five poses, times that do
/// not ascend, or more than a quarter turn from the middle pose.
core::Result<SlidingState> fit_sliding(std::span<const TimedPose> poses);

}  // namespace prescene::simulation
