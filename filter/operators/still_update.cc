// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/operators/still_update.h"

#include <algorithm>
#include <cmath>

#include "prescene/geometry/dense_solvers.h"

namespace prescene::filter {

using geometry::Matrix6d;
using geometry::Vector6d;

namespace {

constexpr double kLeastRatio =
    0.01;  // of variances; a frame that says less of a direction than this says nothing of it

}  // namespace

StillUpdate still_update(const Matrix6d& covariance, const Matrix6d& information, const Vector6d& gradient,
                         double common) {
  // Coordinates in which the prediction's covariance is the identity and the frame's information diagonal.
  const Matrix6d root = geometry::Cholesky6(covariance).factor();
  const Matrix6d whitened = root.transpose() * information * root;
  const geometry::SymmetricEigen6 eigen = geometry::symmetric_eigen_6(0.5 * (whitened + whitened.transpose()));
  const Matrix6d axes = root * eigen.vectors;
  const Vector6d slope = axes.transpose() * gradient;
  StillUpdate update;
  Vector6d step = Vector6d::Zero(), kept = Vector6d::Ones();
  for (int i = 0; i < 6; ++i) {
    const double ratio = eigen.values[i];  // variance of the prediction over that of the frame
    if (!(ratio > kLeastRatio)) continue;
    // In units of the frame's variance, the prediction has `common` of its error from the same source, and the rest of
    // its own; a frame that is worse than the earlier ones together says nothing new.
    const double own = std::max(0.0, ratio - common);
    const double innovation = own + 1.0 - common;
    const double gain = own / innovation;
    const double squared = slope[i] * slope[i] / ratio;  // where the frame has its maximum, in its deviations
    step[i] = gain * slope[i] / ratio;
    if (own > 0.0) kept[i] = (common + (1.0 - common) * gain) / ratio;
    update.largest_gain = std::max(update.largest_gain, gain);
    update.log_evidence -= 0.5 * (squared / innovation + std::log(innovation));
    update.below_peak += 0.5 * (1.0 - gain) * (1.0 - gain) * squared;
  }
  update.shift = axes * step;
  update.covariance = axes * kept.asDiagonal() * axes.transpose();
  update.covariance = (0.5 * (update.covariance + update.covariance.transpose())).eval();
  return update;
}

}  // namespace prescene::filter
