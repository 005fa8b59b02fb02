// SPDX-License-Identifier: Apache-2.0
// Gauss-Newton equations as batches sum them: in camera axes, about the object's origin.
#pragma once

#include "prescene/geometry/pose.h"
#include "prescene/rendering/sensor/likelihood_batch.h"

namespace prescene::rendering {

struct CameraEquations {
  double H[21] = {};  ///< The upper half of the matrix, row by row.
  double g[6] = {};
  int pixels = 0;
  double weight = 0.0;
  double squares = 0.0;
};

/// With rotations turned from camera axes to the body's; without evidence.
PoseLinearisation in_body_axes(const CameraEquations& sums, const geometry::Pose& X_CO);

}  // namespace prescene::rendering
