// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/tracking/camera_presets.h"

#include <algorithm>

#include "prescene/interfaces/bytes/text.h"

namespace prescene::service {
namespace {

using interfaces::DomainTopic;

// Of more topics, the first are named.
constexpr std::size_t kMostNamed = 12;

bool has(std::span<const DomainTopic> topics, std::string_view name) {
  return std::any_of(topics.begin(), topics.end(),
                     [&](const DomainTopic& topic) { return topic.name == name && topic.writers > 0; });
}

/// Without "sensor_msgs/msg/".
std::string short_type(const std::string& type) { return type.substr(type.rfind('/') + 1); }

}  // namespace

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

std::string nothing_came_text(const InputTopics& topics, std::span<const DomainTopic> there, const std::string& where,
                              const std::string& camera) {
  std::string text =
      (camera.empty() ? "" : "camera " + interfaces::quote(camera) + ": ") + "no depth image on " + topics.depth;
  const auto offered = std::find_if(there.begin(), there.end(), [&](const DomainTopic& topic) {
    return topic.name == topics.depth && topic.writers > 0;
  });
  if (offered != there.end() && is_image_type(offered->type))
    return text + ": the topic is there (" + short_type(offered->type) +
           "), but no message that can be used has come yet; start what publishes it, or name another topic " +
           (camera.empty() ? "with --depth-topic" : "under the camera's 'topics' in the scene file");
  if (offered != there.end()) text += ", which is offered as " + offered->type;
  const std::vector<DomainTopic> images = image_topics(there);
  if (images.empty())
    return text + "; there is no image topic " + where +
           ": start the camera's driver, in the same domain (--domain, ROS_DOMAIN_ID)";
  text += "; image topics " + where + ": ";
  for (std::size_t i = 0; i < std::min(images.size(), kMostNamed); ++i)
    text += (i == 0 ? "" : ", ") + images[i].name + " (" + short_type(images[i].type) + ")";
  if (images.size() > kMostNamed) text += " and " + std::to_string(images.size() - kMostNamed) + " more";
  if (!camera.empty()) return text + ": correct the camera's 'topics' (or 'preset' and 'namespace') in the scene file";
  for (const CameraPreset& preset : camera_presets()) {
    if (has(there, preset.depth) && preset.depth != topics.depth)
      return text + ": --camera " + std::string(preset.name) + " has these names";
  }
  return text + ": name the camera's with --depth-topic, --color-topic and --camera-info-topic, or --camera";
}

}  // namespace prescene::service
