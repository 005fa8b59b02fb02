// SPDX-License-Identifier: Apache-2.0
// The camera of simulated evaluations, and where it looks.
#pragma once

#include "prescene/geometry/level_camera.h"
#include "prescene/service/recording/simulated_recording.h"

namespace prescene::service {

/// A camera that is not the tracker's own model of one: noisier, correlated over larger patches, with more of a fixed
/// pattern, and more holes and flying pixels.
inline void set_suite_camera(SimulatedRecordingOptions& options) {
  options.sensor.sigma_per_depth_squared *= 1.2;
  options.sensor.incidence_knee = 0.5;
  options.camera.fixed_pattern_share = 0.35;
  options.camera.correlated_share = 0.45;
  options.camera.correlation_px = 20.0;
  options.camera.edge_outlier = {0.30, 0.22, 0.10, 0.02};
  options.camera.interior_outlier = 0.015;
  options.camera.quantisation_per_depth_squared = 0.0018;
  options.camera.color_noise = 4.0;
}

/// X_WC of a camera at `eye` that looks at `target`, its image upright in a world with z up. The line of sight must not
/// be vertical.
inline geometry::Pose looking_at(const geometry::Vector3d& eye, const geometry::Vector3d& target) {
  return {geometry::Quaterniond(geometry::level_camera((target - eye).normalized())), eye};
}

}  // namespace prescene::service
