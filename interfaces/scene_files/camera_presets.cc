// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/scene_files/camera_presets.h"

#include <algorithm>
#include <array>

namespace prescene::interfaces {
namespace {

// As the launch files of the drivers name them in August 2026, without arguments of the user.
constexpr std::array<CameraPreset, 4> kPresets = {{
    {"azure", "azure_kinect_ros_driver (branch humble)", "", "/depth_to_rgb/image_raw", "/rgb/image_raw",
     "/rgb/camera_info", false, ""},
    {"orbbec", "orbbec_camera (OrbbecSDK_ROS2)", "depth_registration:=true", "/camera/depth/image_raw",
     "/camera/color/image_raw", "/camera/color/camera_info", false, "/camera"},
    {"realsense", "realsense2_camera 4.55 or later", "align_depth.enable:=true",
     "/camera/camera/aligned_depth_to_color/image_raw", "/camera/camera/color/image_raw",
     "/camera/camera/color/camera_info", false, "/camera/camera"},
    {"zed", "zed_wrapper 5", "", "/zed/zed_node/depth/depth_registered", "/zed/zed_node/rgb/color/rect/image",
     "/zed/zed_node/rgb/color/rect/camera_info", true, "/zed/zed_node"},
}};

}  // namespace

std::span<const CameraPreset> camera_presets() { return kPresets; }

const CameraPreset* find_camera_preset(std::string_view name) {
  const auto* found =
      std::find_if(kPresets.begin(), kPresets.end(), [&](const CameraPreset& preset) { return preset.name == name; });
  return found == kPresets.end() ? nullptr : found;
}

belief::CameraTopics topics_of(const CameraPreset& preset, std::string_view name_space) {
  const auto named = [&](std::string_view topic) {
    return name_space.empty() ? std::string(topic)
                              : std::string(name_space) + std::string(topic.substr(preset.name_space.size()));
  };
  belief::CameraTopics topics;
  topics.depth = named(preset.depth);
  topics.color = named(preset.color);
  topics.camera_info = named(preset.camera_info);
  topics.rectified = preset.rectified;
  return topics;
}

belief::CameraTopics topics_of_name(const std::string& camera) {
  belief::CameraTopics topics;
  topics.depth = "/" + camera + "/aligned_depth_to_color/image_raw";
  topics.color = "/" + camera + "/color/image_raw";
  topics.camera_info = "/" + camera + "/color/camera_info";
  return topics;
}

}  // namespace prescene::interfaces
