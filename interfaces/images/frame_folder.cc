// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/images/frame_folder.h"

#include <algorithm>
#include <cmath>
#include <system_error>
#include <utility>

#include "frame_list.h"
#include "prescene/core/check.h"
#include "prescene/interfaces/bytes/file.h"
#include "prescene/interfaces/bytes/text.h"
#include "prescene/interfaces/images/jpeg.h"

namespace prescene::interfaces {
namespace {

using core::Result;
using core::Status;
using geometry::PinholeCamera;
namespace fs = std::filesystem;

constexpr const char* kPosesFile = "camera_poses.csv";
constexpr const char* kIntrinsicsFile = "intrinsics.K.txt";
constexpr std::size_t kMaxTextBytes = std::size_t{64} << 20;
constexpr std::string_view kColorSuffix = ".color.png";
constexpr std::string_view kDepthSuffix = ".depth.png";

template <class Parse>
auto parse_file(const fs::path& path, Parse parse) -> decltype(parse({})) {
  const Result<std::vector<std::uint8_t>> bytes = read_file(path, kMaxTextBytes);
  if (!bytes) return bytes.status();
  auto parsed = parse(std::string_view(reinterpret_cast<const char*>(bytes->data()), bytes->size()));
  if (!parsed) return parsed.status().at(path.string());
  return parsed;
}

Result<std::vector<FolderFrame>> list_with_poses(const fs::path& folder, const FrameFolderOptions& options) {
  PRESCENE_TRY(std::vector<FolderFrame> frames, parse_file(folder / kPosesFile, [&](std::string_view text) {
                 return parse_camera_poses(text, options);
               }));
  for (FolderFrame& frame : frames) {
    frame.color = folder / frame.color;
    frame.depth = folder / frame.depth;
  }
  return frames;
}

Status cannot_look(const fs::path& path, const std::error_code& error) {
  return core::unavailable(path.string() + ": cannot be looked at: " + error.message() + "; make it readable");
}

/// Whether something of that name is there, readable or not: a link that leads nowhere is. Fails where that can't be
/// reported.
Result<bool> is_there(const fs::path& path) {
  std::error_code error;
  const fs::file_status found = fs::symlink_status(path, error);
  if (found.type() == fs::file_type::not_found) return false;
  if (error) return cannot_look(path, error);
  return true;
}

/// The frames of which a folder has the colour or the depth, by name; none where there is no such folder.
Result<std::vector<FolderFrame>> list_without_poses(const fs::path& folder, const FrameFolderOptions& options) {
  PRESCENE_TRY(const bool there, is_there(folder));
  std::vector<fs::path> colors;
  std::error_code error;
  if (there) {
    fs::directory_iterator entry(folder, error);
    if (error == std::errc::not_a_directory) return std::vector<FolderFrame>{};
    for (const fs::directory_iterator end; !error && entry != end; entry.increment(error)) {
      const std::string file_name = entry->path().filename().string();
      for (const std::string_view suffix : {kColorSuffix, kDepthSuffix}) {
        if (!file_name.ends_with(suffix)) continue;
        colors.push_back(folder / (file_name.substr(0, file_name.size() - suffix.size()) + std::string(kColorSuffix)));
      }
    }
  }
  if (error) return cannot_look(folder, error);
  std::sort(colors.begin(), colors.end());
  colors.erase(std::unique(colors.begin(), colors.end()), colors.end());
  std::vector<FolderFrame> frames;
  for (const fs::path& color : colors) {
    const std::string file_name = color.filename().string();
    const std::string name = file_name.substr(0, file_name.size() - kColorSuffix.size());
    frames.push_back({name, color, folder / (name + std::string(kDepthSuffix)), stamp_at(frames.size(), options), {}});
  }
  return frames;
}

Result<std::vector<FolderFrame>> list_frames(const fs::path& folder, const FrameFolderOptions& options) {
  std::error_code error;
  if (!fs::is_directory(folder, error)) {
    return core::not_found(folder.string() + ": is no folder; give the folder with the frames");
  }
  PRESCENE_TRY(const bool has_poses, is_there(folder / kPosesFile));
  if (has_poses) return list_with_poses(folder, options);
  for (const fs::path& place : {folder / "frames", folder}) {
    PRESCENE_TRY(std::vector<FolderFrame> frames, list_without_poses(place, options));
    if (!frames.empty()) return frames;
  }
  PRESCENE_TRY(const bool has_color, is_there(folder / "color.png"));
  PRESCENE_TRY(const bool has_depth, is_there(folder / "depth.png"));
  if (has_color || has_depth) {
    return std::vector<FolderFrame>{
        {folder.filename().string(), folder / "color.png", folder / "depth.png", options.first_stamp_ns, {}}};
  }
  return core::not_found(folder.string() + ": has no frames; put camera_poses.csv, frames/NAME.color.png with " +
                         "NAME.depth.png, or color.png with depth.png there");
}

Result<PinholeCamera> find_camera(const fs::path& folder, const FrameFolderOptions& options, const FolderFrame& first) {
  PRESCENE_TRY(const ImageSize size, read_png_size(first.depth, options.limits));
  PRESCENE_TRY(const bool has_intrinsics, is_there(folder / kIntrinsicsFile));
  PinholeCamera camera;
  std::string place;
  if (has_intrinsics) {
    place = (folder / kIntrinsicsFile).string();
    PRESCENE_TRY(camera, parse_file(folder / kIntrinsicsFile, parse_intrinsics));
    camera.width = size.width;
    camera.height = size.height;
  } else if (options.camera) {
    place = "camera";
    camera = *options.camera;
    if (camera.width != size.width || camera.height != size.height) {
      return core::invalid_input(first.depth.string() + ": has " + std::to_string(size.width) + " x " +
                                 std::to_string(size.height) + " pixels, but the camera given has " +
                                 std::to_string(camera.width) + " x " + std::to_string(camera.height));
    }
  } else {
    return core::not_found(folder.string() + ": there is no " + kIntrinsicsFile +
                           "; put the 3x3 camera matrix there, or give the camera (width, height, fx, fy, cx, cy)");
  }
  const Status status = geometry::validate_sensor(camera);
  if (!status.ok()) return status.at(place);
  return camera;
}

Status check_size(const fs::path& path, int width, int height, const PinholeCamera& camera) {
  if (width == camera.width && height == camera.height) return core::ok_status();
  return core::invalid_input(path.string() + ": has " + std::to_string(width) + " x " + std::to_string(height) +
                             " pixels, but the camera has " + std::to_string(camera.width) + " x " +
                             std::to_string(camera.height) + "; colour and depth must be registered, of one size");
}

}  // namespace

Result<FrameFolder> FrameFolder::open(const fs::path& folder, const FrameFolderOptions& options) {
  if (!(options.metres_per_unit > 0.0) || !std::isfinite(options.metres_per_unit)) {
    return core::invalid_input("metres_per_unit is " + number_text(options.metres_per_unit) +
                               "; it must be positive, 0.001 for millimetres");
  }
  if (!(options.frames_per_second >= 1e-3 && options.frames_per_second <= 1e6) || options.first_stamp_ns < 0) {
    return core::invalid_input("frames_per_second is " + number_text(options.frames_per_second) +
                               " and first_stamp_ns " + std::to_string(options.first_stamp_ns) +
                               "; they must be from 0.001 to 1000000, and not negative");
  }
  FrameFolder out;
  out.options_ = options;
  PRESCENE_TRY(out.frames_, list_frames(folder, options));
  for (const FolderFrame& frame : out.frames_) {
    for (const fs::path& path : {frame.color, frame.depth}) {
      std::error_code error;
      if (!fs::exists(path, error)) {
        return core::not_found(path.string() + ": is missing for frame " + frame.name +
                               "; add it or take the frame out");
      }
    }
  }
  PRESCENE_TRY(out.camera_, find_camera(folder, options, out.frames_.front()));
  return out;
}

Result<RgbdImages> FrameFolder::load(std::size_t index) const {
  PRESCENE_CHECK(index < frames_.size());
  const FolderFrame& frame = frames_[index];
  RgbdImages images;
  PRESCENE_TRY(images.color, read_color(frame.color, options_.limits));
  PRESCENE_TRY(images.depth, read_png_depth(frame.depth, options_.metres_per_unit, options_.limits));
  PRESCENE_RETURN_IF_ERROR(check_size(frame.color, images.color.width(), images.color.height(), camera_));
  PRESCENE_RETURN_IF_ERROR(check_size(frame.depth, images.depth.width(), images.depth.height(), camera_));
  return images;
}

}  // namespace prescene::interfaces
