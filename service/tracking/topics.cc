// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/tracking/topics.h"

#include <algorithm>
#include <cctype>
#include <map>
#include <utility>

#include "prescene/core/utf8.h"
#include "prescene/interfaces/ros_messages/cdr.h"

namespace prescene::service {

bool names_rectified_images(const std::string& topic) {
  return topic.substr(topic.rfind('/') + 1).starts_with("image_rect");
}

core::Status validate(const InputTopics& topics) {
  const std::pair<const char*, const std::string*> named[] = {{"depth", &topics.depth},
                                                              {"color", &topics.color},
                                                              {"camera info", &topics.camera_info},
                                                              {"tf", &topics.tf},
                                                              {"static tf", &topics.tf_static}};
  std::map<std::string, const char*> seen;
  for (const auto& [what, topic] : named) {
    if (!core::is_utf8(*topic))
      return core::invalid_input(std::string("the ") + what +
                                 " topic's name is not UTF-8: give one of letters, digits, _ and /");
    if (topic->empty()) {
      if (topic == &topics.color) continue;
      return core::invalid_input(std::string("the ") + what + " topic has no name: only colour can be left out");
    }
    const auto [other, is_new] = seen.emplace(*topic, what);
    if (!is_new)
      return core::invalid_input(std::string("the ") + what + " topic is the " + other->second + " topic, " + *topic +
                                 ": name the two that the camera has");
  }
  return core::ok_status();
}

std::string pose_topic(const std::string& object) {
  std::string name = "/prescene/pose/";
  // Object names may hold '-' and '.', and begin with digits; ROS names may not.
  if (object.empty() || std::isdigit(static_cast<unsigned char>(object.front()))) name += '_';
  for (const char c : object) name += std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
  return name;
}

std::vector<BusTopic> bus_topics(const InputTopics& topics) {
  using interfaces::TopicQos;
  std::vector<BusTopic> rows = {
      {topics.depth, "sensor_msgs/msg/Image", TopicQos::kSensor, TopicQos::kImages},
      {topics.color, "sensor_msgs/msg/Image", TopicQos::kSensor, TopicQos::kImages},
      {topics.camera_info, "sensor_msgs/msg/CameraInfo", TopicQos::kSensor, TopicQos::kReliable},
      {topics.tf, "tf2_msgs/msg/TFMessage", TopicQos::kTf, TopicQos::kTf},
      {topics.tf_static, "tf2_msgs/msg/TFMessage", TopicQos::kTfStatic, TopicQos::kLatched},
      {kControlTopic, "std_msgs/msg/String", TopicQos::kCommands, TopicQos::kCommands},
      {kQueryTopic, "std_msgs/msg/String", TopicQos::kCommands, TopicQos::kCommands},
      {kAnswerTopic, "std_msgs/msg/String", TopicQos::kCommands, TopicQos::kReliable},
  };
  std::erase_if(rows, [](const BusTopic& row) { return row.name.empty(); });
  return rows;
}

interfaces::TopicQos offered_as(const std::string& topic, const std::string& type) {
  using interfaces::TopicQos;
  const std::vector<BusTopic> rows = bus_topics({});
  const auto known = std::find_if(rows.begin(), rows.end(), [&](const BusTopic& row) { return row.name == topic; });
  if (known != rows.end() && known->type == type) return known->write;
  if (type == "sensor_msgs/msg/Image") return TopicQos::kImages;
  if (type == "tf2_msgs/msg/TFMessage") return topic.ends_with("static") ? TopicQos::kLatched : TopicQos::kTf;
  return TopicQos::kReliable;
}

bool is_parsed_in_recordings(const std::string& topic) {
  return topic == kStepTopic || topic == kTruthTopic || topic == kOutcomeTopic;
}

std::size_t most_json_bytes(const std::string& topic) {
  return is_parsed_in_recordings(topic) ? kMostParsedJsonBytes : interfaces::CdrLimits().max_string_bytes;
}

}  // namespace prescene::service
