// SPDX-License-Identifier: Apache-2.0
// The topics of common RGB-D cameras' drivers as the tracker's, and what to say where no image comes.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "prescene/interfaces/dds/dds_node.h"
#include "prescene/interfaces/scene_files/camera_presets.h"
#include "prescene/service/tracking/tracker_settings.h"

namespace prescene::service {

using interfaces::camera_presets;
using interfaces::CameraPreset;
using interfaces::find_camera_preset;
/// Sets the topics of the images and whether they are rectified; tf stays.
void apply(const CameraPreset& preset, TrackerSettings& settings);

/// s to wait for the first image before saying that nothing comes.
inline constexpr double kNothingCameAfter = 5.0;

/// "depth /a, colour /b, camera info /c, tf /tf and /tf_static".
std::string topics_text(const InputTopics& topics);

/// Those that carry images or point clouds and are written by somebody.
std::vector<interfaces::DomainTopic> image_topics(std::span<const interfaces::DomainTopic> topics);
/// For a person, where nothing has come on the depth topic of `topics`: whether it is offered at all, what images there
/// are `where` ("in DDS domain 0", "in the recording"), and the preset that fits them. `camera`: as the scene file
/// lists it, whose topics are named there; "" = options name them.
std::string nothing_came_text(const InputTopics& topics, std::span<const interfaces::DomainTopic> there,
                              const std::string& where, const std::string& camera = "");

}  // namespace prescene::service
