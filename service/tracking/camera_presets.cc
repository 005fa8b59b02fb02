// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/tracking/camera_presets.h"

#include <algorithm>
#include <array>

namespace prescene::service {
namespace {

using interfaces::DomainTopic;

// As the launch files of the drivers name them in August 2026, without arguments of the user.
constexpr std::array<CameraPreset, 4> kPresets = {{
    {"azure", "azure_kinect_ros_driver (branch humble)", "", "/depth_to_rgb/image_raw", "/rgb/image_raw",
     "/rgb/camera_info", false},
    {"orbbec", "orbbec_camera (OrbbecSDK_ROS2)", "depth_registration:=true", "/camera/depth/image_raw",
     "/camera/color/image_raw", "/camera/color/camera_info", false},
    {"realsense", "realsense2_camera 4.55 or later", "align_depth.enable:=true",
     "/camera/camera/aligned_depth_to_color/image_raw", "/camera/camera/color/image_raw",
     "/camera/camera/color/camera_info", false},
    {"zed", "zed_wrapper 5", "", "/zed/zed_node/depth/depth_registered", "/zed/zed_node/rgb/color/rect/image",
     "/zed/zed_node/rgb/color/rect/camera_info", true},
}};

// Of more topics, the first are named.
constexpr std::size_t kMostNamed = 12;

bool has(std::span<const DomainTopic> topics, std::string_view name) {
  return std::any_of(topics.begin(), topics.end(),
                     [&](const DomainTopic& topic) { return topic.name == name && topic.writers > 0; });
}

/// Without "sensor_msgs/msg/".
std::string short_type(const std::string& type) { return type.substr(type.rfind('/') + 1); }

}  // namespace

std::span<const CameraPreset> camera_presets() { return kPresets; }

const CameraPreset* find_camera_preset(std::string_view name) {
  const auto* found =
      std::find_if(kPresets.begin(), kPresets.end(), [&](const CameraPreset& preset) { return preset.name == name; });
  return found == kPresets.end() ? nullptr : found;
}

void apply(const CameraPreset& preset, TrackerSettings& settings) {
  settings.topics.depth = preset.depth;
  settings.topics.color = preset.color;
  settings.topics.camera_info = preset.camera_info;
  settings.assembler.rectified = preset.rectified;
}

std::string topics_text(const InputTopics& topics) {
  return "depth " + topics.depth + ", " + (topics.color.empty() ? "no colour" : "colour " + topics.color) +
         ", camera info " + topics.camera_info + ", tf " + topics.tf + " and " + topics.tf_static;
}

std::vector<DomainTopic> image_topics(std::span<const DomainTopic> topics) {
  std::vector<DomainTopic> images;
  std::copy_if(topics.begin(), topics.end(), std::back_inserter(images),
               [](const DomainTopic& topic) { return topic.writers > 0 && is_image_type(topic.type); });
  return images;
}

std::string nothing_came_text(const InputTopics& topics, std::span<const DomainTopic> there, const std::string& where) {
  std::string text = "no depth image on " + topics.depth;
  const auto offered = std::find_if(there.begin(), there.end(), [&](const DomainTopic& topic) {
    return topic.name == topics.depth && topic.writers > 0;
  });
  if (offered != there.end() && is_image_type(offered->type))
    return text + ": the topic is there (" + short_type(offered->type) +
           "), but no message of it came that could be used; start what publishes it, or name another topic with "
           "--depth-topic";
  if (offered != there.end()) text += ", which is offered as " + offered->type;
  const std::vector<DomainTopic> images = image_topics(there);
  if (images.empty())
    return text + "; there is no image topic " + where +
           ": start the camera's driver, in the same domain (--domain, ROS_DOMAIN_ID)";
  text += "; image topics " + where + ": ";
  for (std::size_t i = 0; i < std::min(images.size(), kMostNamed); ++i)
    text += (i == 0 ? "" : ", ") + images[i].name + " (" + short_type(images[i].type) + ")";
  if (images.size() > kMostNamed) text += " and " + std::to_string(images.size() - kMostNamed) + " more";
  for (const CameraPreset& preset : kPresets) {
    if (has(there, preset.depth) && preset.depth != topics.depth)
      return text + ": --camera " + std::string(preset.name) + " has these names";
  }
  return text + ": name the camera's with --depth-topic, --color-topic and --camera-info-topic, or --camera";
}

}  // namespace prescene::service
