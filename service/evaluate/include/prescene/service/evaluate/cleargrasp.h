// SPDX-License-Identifier: Apache-2.0
// Does the transparent material explain real transparent things? ClearGrasp has frames of transparent objects with a
// twin, the same objects painted, which shows where the surface is. Pixel by pixel: which of two materials makes the
// measured depth, or its absence, more likely. No poses: the data set has neither meshes nor poses.
//
//   PRESCENE_TRY(ClearGraspReport report, evaluate_cleargrasp(dir, seed));
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "prescene/core/progress.h"
#include "prescene/core/status.h"
#include "prescene/geometry/camera.h"
#include "prescene/geometry/image.h"
#include "prescene/rendering/sensor/sensor_model.h"

namespace prescene::service {

struct ClearGraspFrame {
  std::string name;  ///< The folder's.
  geometry::PinholeCamera camera;
  geometry::DepthImage transparent;  ///< m, 0 = no return.
  geometry::DepthImage painted;      ///< The same view with the objects painted.
  geometry::LabelImage mask;         ///< Not 0 on transparent objects.
};

/// Every sub-folder with depth_transparent.png, depth_opaque.png and mask.png, by name. Errors name the file.
core::Result<std::vector<ClearGraspFrame>> read_cleargrasp_frames(const std::filesystem::path& dir);

/// Pixels of one kind of return.
struct ClearGraspShare {
  int n = 0;
  int transparent_better = 0;
  double log_ratio = 0.0;  ///< Sum of log p(z | transparent) - log p(z | opaque), nats.

  double share() const { return n > 0 ? static_cast<double>(transparent_better) / n : 0.0; }
  double nats_per_pixel() const { return n > 0 ? log_ratio / n : 0.0; }
};

struct ClearGraspScore {
  std::string frame;
  int mask_pixels = 0;
  bool knows_plane = false;  ///< A support plane was found, so what is behind is known.
  /// Mask pixels where the painted twin shows the surface, by what the camera returned of the transparent object.
  ClearGraspShare all, missing, behind, at_surface, in_front;
  /// The same pixels of the painted twin itself, which the opaque material should explain better.
  ClearGraspShare painted;
};

struct ClearGraspReport {
  std::vector<ClearGraspScore> frames;
  ClearGraspScore total;
};

/// One frame.
ClearGraspScore score_cleargrasp(const ClearGraspFrame& frame, const rendering::SensorModel& model, std::uint64_t seed);

core::Result<ClearGraspReport> evaluate_cleargrasp(const std::filesystem::path& dir, std::uint64_t seed,
                                                   const core::ProgressSink& progress = {},
                                                   const core::Cancellation* cancellation = nullptr);

nlohmann::ordered_json to_json(const ClearGraspReport& report);

}  // namespace prescene::service
