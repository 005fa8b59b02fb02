// SPDX-License-Identifier: Apache-2.0
// The depth noise of a camera from a recording in which nothing moves, camera included: what each pixel's returns do
// over time, by depth, incidence and distance to edges, and the sensor model's settings that say the same.
//
//   DepthNoiseEstimator estimator;
//   for (const geometry::DepthImage& depth : images) PRESCENE_RETURN_IF_ERROR(estimator.add(depth, camera));
//   PRESCENE_TRY(DepthNoise noise, estimator.finish());
#pragma once

#include <array>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "prescene/core/progress.h"
#include "prescene/core/status.h"
#include "prescene/geometry/camera.h"
#include "prescene/geometry/image.h"
#include "prescene/rendering/sensor/sensor_model.h"

namespace prescene::service {

/// A value over the pixels of one class.
struct DepthNoiseClass {
  double limit = 0.0;  ///< Upper end of the class: depth (m), cosine, or pixels from an edge.
  int pixels = 0;
  double sigma = 0.0;    ///< Over time, divided by depth squared, 1/m.
  double missing = 0.0;  ///< Share of frames without a return.
};

struct DepthNoise {
  int frames = 0;
  int pixels = 0;                             ///< With enough returns to be judged.
  double sigma_over_time = 0.0;               ///< Over depth squared, 1/m, of pixels seen frontally far from edges.
  double missing = 0.0;                       ///< Of the same pixels.
  double outliers = 0.0;                      ///< Of the same pixels: share of returns more than some 4 deviations off.
  std::vector<DepthNoiseClass> by_depth;      ///< Frontal, far from edges.
  std::vector<DepthNoiseClass> by_incidence;  ///< Far from edges.
  std::vector<DepthNoiseClass> by_edge;       ///< Frontal.
  /// Step of returned depths over depth squared, 1/m, where steps grow so; else nothing, and `step` has the even step.
  std::optional<double> quantisation_per_depth_squared;
  std::optional<double> step;  ///< m
  /// The model's defaults with what was found in their place.
  rendering::SensorModelOptions settings;
  std::vector<std::string> found;    ///< Names of the settings that come from this recording.
  std::vector<std::string> remarks;  ///< What it does not show, and why.
};

class DepthNoiseEstimator {
 public:
  static constexpr int kFewestFrames = 12;

  /// Keeps at most 200 frames and some 130 MB (but kFewestFrames of any size); later ones are ignored. Values that are
  /// negative or not finite count as no return. Fails with kInvalidInput for a camera that makes no sense, and when an
  /// image's size changes or is not the camera's.
  core::Status add(const geometry::DepthImage& depth, const geometry::PinholeCamera& camera);
  /// Whether further frames are ignored.
  bool full() const { return static_cast<int>(frames_.size()) >= most_frames_; }

  /// kInvalidInput for too few frames, for a recording in which something moves, and where no surface is seen well.
  core::Result<DepthNoise> finish() const;

 private:
  geometry::PinholeCamera camera_;
  std::vector<geometry::DepthImage> frames_;
  int most_frames_ = kFewestFrames;
};

/// Of a recording (.mcap) or a folder of images. Of a recording the depth images and the camera info are taken from the
/// topics that its own settings name, or from the default ones if it has no settings; of several cameras that its scene
/// lists, from those of `camera`. `metres_per_unit`: of the
/// depth PNGs of a folder; not used for recordings. Fails as RecordingReader and interfaces::FrameFolder do for files
/// that cannot be read, as DepthNoiseEstimator does, with kInvalidInput when a recording has no depth image or no
/// camera info on its topic, or has several cameras and `camera` names none of them, and with kCancelled when asked to
/// stop; texts begin with the path.
core::Result<DepthNoise> depth_noise_of(const std::filesystem::path& path, double metres_per_unit,
                                        const core::ProgressSink& progress, const core::Cancellation& cancellation,
                                        const std::string& camera = "");

nlohmann::ordered_json to_json(const DepthNoise& noise);

}  // namespace prescene::service
