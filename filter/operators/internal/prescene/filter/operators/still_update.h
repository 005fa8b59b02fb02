// SPDX-License-Identifier: Apache-2.0
// How a pose that does not change becomes known from many frames: a Kalman update for errors of which a share is the
// same in all frames (a consider filter [Schmidt 1966]). What differs from frame to frame averages out: in the n-th
// frame the gain is 1 / n, so the pose comes to rest; its covariance ends at that of the common share.
//
//   const StillUpdate update = still_update(covariance, information, gradient, 0.5);
//   ... geometry::box_plus(X_WO, update.shift);
#pragma once

#include "prescene/geometry/pose.h"

namespace prescene::filter {

struct StillUpdate {
  geometry::Vector6d shift;       ///< Of the mean, from the prediction.
  geometry::Matrix6d covariance;  ///< After the frame.
  double largest_gain = 0.0;      ///< Over all directions; 1 = the frame alone decides.
  double log_evidence = 0.0;      ///< nats; log of the likelihood integrated over the prediction, less its maximum.
  double below_peak = 0.0;        ///< nats by which the log likelihood at the new mean is below its maximum.
};

/// `covariance`: of the prediction (rotation, translation as geometry::box_plus), positive definite. `information`,
/// `gradient`: of the frame's log likelihood at the prediction's mean, in the same coordinates; directions of which the
/// frame says nearly nothing (less than a hundredth of what is known) stay as they are. `common`: share of a frame's
/// variance that all frames have in common, in [0, 1). A frame with less information than the frames before have in
/// common changes nothing.
StillUpdate still_update(const geometry::Matrix6d& covariance, const geometry::Matrix6d& information,
                         const geometry::Vector6d& gradient, double common);

}  // namespace prescene::filter
