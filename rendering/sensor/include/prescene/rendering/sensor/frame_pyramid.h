// SPDX-License-Identifier: Apache-2.0
// One frame at several resolutions: a thing that covers ten pixels of a coarse image is weighed by a finer one, and a
// near one needs no more than the coarse one.
//
//   FramePyramid pyramid;                                                      // once
//   PRESCENE_RETURN_IF_ERROR(pyramid.reset(input, {}, model));                 // once a frame
//   const FrameTerms& terms = pyramid.level(pyramid.level_for(*mesh, X_CO));   // once a frame and object
//
// Log ratios of two levels are of different data: compare poses of one object under one level.
#pragma once

#include <vector>

#include "prescene/core/status.h"
#include "prescene/rendering/sensor/likelihood_batch.h"

namespace prescene::rendering {

struct FramePyramidOptions {
  int coarsest_width = 80;  ///< Of the first level, as FrameTermsOptions::target_width; each next is twice as wide ...
  int finest_width = 640;   ///< ... up to this one, at most the frame's own.
  /// Reduced pixels that are enough for an object; more gain little (docs/reference/sensor_model.md).
  double enough_pixels = 100.0;
  TemperingOptions tempering;
};

/// Pixels of the camera's image that the mesh covers at a pose, with nothing in front of it and an image without end:
/// the projected area of the faces that are turned to the camera. Exact for convex things, too many where a thing hides
/// a part of itself. 0 when it reaches behind the camera.
double covered_pixels(const RenderMesh& mesh, const geometry::Pose& X_CO, const geometry::PinholeCamera& camera);

/// Levels are made when they are first asked for. One thread at a time may call; what level() gave may be read by any
/// number of threads until the next reset().
class FramePyramid {
 public:
  /// Takes a new frame, reusing memory, and makes the coarsest level. What `input` refers to must stay until the last
  /// level was made. Fails as make_frame_terms does, and with kInvalidInput when a width or enough_pixels is not
  /// positive; there is then no level.
  core::Status reset(const FrameTermsInput& input, const FramePyramidOptions& options, const SensorModel& model);

  /// 0 = the coarsest. Each has half the step of the one before.
  int levels() const { return static_cast<int>(steps_.size()); }
  /// The coarsest level in which the object covers enough pixels at this pose; else the finest.
  int level_for(const RenderMesh& mesh, const geometry::Pose& X_CO) const;
  const FrameTerms& level(int index);

 private:
  FrameTermsInput input_;
  FramePyramidOptions options_;
  SensorModel model_;
  std::vector<int> steps_;  ///< Full-image pixels between two sampled ones, of each level.
  std::vector<FrameTerms> terms_;
  std::vector<bool> made_;
};

}  // namespace prescene::rendering
