// SPDX-License-Identifier: Apache-2.0
// RGB-D frames in a folder of PNGs (colour may be JPEG), in one of three layouts:
//
//   - camera_poses.csv, with a header line naming the columns frame, color, depth, m00 ... m33 (camera-to-world,
//     row-major, metres, optical axes) and optionally stamp_ns; file names relative to the folder;
//   - frames/*.color.png (or beside) with the matching *.depth.png and no poses: the camera stands still at
//     X_WC = identity;
//   - color.png and depth.png, a single frame.
//
// The camera comes from intrinsics.K.txt (3x3) in the folder, else from the options. Images are read when asked for.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "prescene/core/status.h"
#include "prescene/geometry/camera.h"
#include "prescene/geometry/image.h"
#include "prescene/geometry/pose.h"
#include "prescene/interfaces/images/png.h"

namespace prescene::interfaces {

struct FrameFolderOptions {
  double metres_per_unit = 0.001;   ///< Of the depth PNGs.
  double frames_per_second = 30.0;  ///< Stamps frames without stamp_ns.
  std::int64_t first_stamp_ns = 0;
  /// Needed where the folder has no intrinsics.K.txt; otherwise ignored.
  std::optional<geometry::PinholeCamera> camera = std::nullopt;
  ImageLimits limits = {};
};

struct FolderFrame {
  std::string name;
  std::filesystem::path color;
  std::filesystem::path depth;
  std::int64_t stamp_ns = 0;
  geometry::Pose X_WC;

  friend bool operator==(const FolderFrame&, const FolderFrame&) = default;
};

/// Colour and depth of one frame, of the same size, registered pixel to pixel.
struct RgbdImages {
  geometry::ColorImage color;
  geometry::DepthImage depth;
};

/// The frames of a folder in order of time. Keeps no file open.
class FrameFolder {
 public:
  /// Reads the list, the camera and the first image's size, and checks that every file is there. kNotFound for missing
  /// files, kInvalidInput for wrong cells, poses that are not rigid, stamps that do not grow, and file names that leave
  /// the folder; kUnavailable where a folder or file can't be looked at to the end; the text names file and line.
  static core::Result<FrameFolder> open(const std::filesystem::path& folder, const FrameFolderOptions& options = {});

  const geometry::PinholeCamera& camera() const { return camera_; }
  const std::vector<FolderFrame>& frames() const { return frames_; }
  /// Images of frames()[index]; kInvalidInput when their size is not the camera's.
  core::Result<RgbdImages> load(std::size_t index) const;

 private:
  FrameFolderOptions options_;
  geometry::PinholeCamera camera_;
  std::vector<FolderFrame> frames_;
};

}  // namespace prescene::interfaces
