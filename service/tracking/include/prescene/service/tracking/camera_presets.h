// SPDX-License-Identifier: Apache-2.0
// What the drivers of common RGB-D cameras call their topics, and what to say where no image comes.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "prescene/interfaces/dds/dds_node.h"
#include "prescene/service/tracking/tracker_settings.h"

namespace prescene::service {

/// Names of a driver started with its own defaults.
struct CameraPreset {
  std::string_view name;    ///< "realsense"
  std::string_view driver;  ///< "realsense2_camera 4.55 or later"
  std::string_view needs;   ///< What its launch file must be told for registered depth; "" = nothing.
  std::string_view depth;   ///< Topics, as in InputTopics.
  std::string_view color;
  std::string_view camera_info;
  bool rectified = false;  ///< The images are.
};

/// By name.
std::span<const CameraPreset> camera_presets();
/// Null for a name that is none.
const CameraPreset* find_camera_preset(std::string_view name);
/// Sets the topics of the images and whether they are rectified; tf stays.
void apply(const CameraPreset& preset, TrackerSettings& settings);

/// s to wait for the first image before saying that nothing comes.
inline constexpr double kNothingCameAfter = 5.0;

/// "depth /a, colour /b, camera info /c, tf /tf and /tf_static".
std::string topics_text(const InputTopics& topics);

/// Those that carry images or point clouds and are written by somebody.
std::vector<interfaces::DomainTopic> image_topics(std::span<const interfaces::DomainTopic> topics);
/// For a person, where nothing has come on the depth topic of `topics`: whether it is offered at all, what images there
/// are `where` ("in DDS domain 0", "in the recording"), and the preset that fits them.
std::string nothing_came_text(const InputTopics& topics, std::span<const interfaces::DomainTopic> there,
                              const std::string& where);

}  // namespace prescene::service
