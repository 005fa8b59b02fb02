// SPDX-License-Identifier: Apache-2.0
// What the drivers of common RGB-D cameras call their topics.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "prescene/belief/scene.h"

namespace prescene::interfaces {

/// Names of a driver started with its own defaults.
struct CameraPreset {
  std::string_view name;    ///< "realsense"
  std::string_view driver;  ///< "realsense2_camera 4.55 or later"
  std::string_view needs;   ///< What its launch file must set for registered depth; "" = nothing.
  std::string_view depth;   ///< Topics, as in belief::CameraTopics.
  std::string_view color;
  std::string_view camera_info;
  bool rectified = false;         ///< The images are.
  std::string_view name_space{};  ///< What all three begin with, and another name of the camera replaces; "" = nothing.
};

/// By name.
std::span<const CameraPreset> camera_presets();
/// Null for a name that is none.
const CameraPreset* find_camera_preset(std::string_view name);

/// The topics of a driver whose camera is called otherwise: `name_space` ("/wrist", "" = the driver's default) stands
/// in place of the preset's.
belief::CameraTopics topics_of(const CameraPreset& preset, std::string_view name_space = "");
/// Those of an old RealSense driver whose camera has this name: "/wrist/color/image_raw", ...
belief::CameraTopics topics_of_name(const std::string& camera);

}  // namespace prescene::interfaces
