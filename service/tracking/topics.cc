// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/tracking/topics.h"

#include <algorithm>
#include <cctype>
#include <map>
#include <utility>

#include "prescene/core/utf8.h"
#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/service/belief_summary.h"

namespace prescene::service {
namespace {

std::string image_type(const std::string& form, const std::string& last_name) {
  const bool packed =
      form == "compressed" || (form.empty() && (last_name == "compressed" || last_name == "compressedDepth"));
  return packed ? "sensor_msgs/msg/CompressedImage" : "sensor_msgs/msg/Image";
}

}  // namespace

bool names_rectified_images(const std::string& topic) {
  std::string image = topic;
  for (const char* packing : {"/compressed", "/compressedDepth"})
    if (image.ends_with(packing)) image.resize(image.size() - std::string(packing).size());
  return image.substr(image.rfind('/') + 1).starts_with("image_rect");
}

std::string depth_type(const InputTopics& topics) {
  const std::string last = topics.depth.substr(topics.depth.rfind('/') + 1);
  if (topics.depth_form == "points" ||
      (topics.depth_form.empty() && (last.starts_with("points") || last.starts_with("cloud"))))
    return "sensor_msgs/msg/PointCloud2";
  return image_type(topics.depth_form, last);
}

std::string color_type(const InputTopics& topics) {
  return image_type(topics.color_form, topics.color.substr(topics.color.rfind('/') + 1));
}

core::Status validate(const InputTopics& topics) {
  const std::pair<const char*, const std::string*> named[] = {
      {"depth", &topics.depth}, {"color", &topics.color},         {"camera info", &topics.camera_info},
      {"tf", &topics.tf},       {"static tf", &topics.tf_static}, {"joint states", &topics.joint_states},
      {"clock", &topics.clock}};
  std::map<std::string, const char*> seen;
  for (const auto& [what, topic] : named) {
    if (!core::is_utf8(*topic))
      return core::invalid_input(std::string("the ") + what +
                                 " topic's name is not UTF-8: give one of letters, digits, _ and /");
    if (topic->empty()) {
      if (topic == &topics.color || topic == &topics.joint_states || topic == &topics.clock) continue;
      return core::invalid_input(std::string("the ") + what +
                                 " topic has no name: only colour and joint states can be left out");
    }
    const auto [other, is_new] = seen.emplace(*topic, what);
    if (!is_new)
      return core::invalid_input(std::string("the ") + what + " topic is the " + other->second + " topic, " + *topic +
                                 ": name the two that the camera has");
  }
  const auto known = [](const std::string& form, bool may_be_points) {
    return form.empty() || form == "image" || form == "compressed" || (may_be_points && form == "points");
  };
  if (!known(topics.depth_form, true) || !known(topics.color_form, false))
    return core::invalid_input("the form of an image topic is image or compressed, of the depth topic also points");
  return core::ok_status();
}

bool are_of_objects(const interfaces::ReceivedMessage& message) {
  if (message.type != "tf2_msgs/msg/TFMessage") return false;
  const auto tf = interfaces::decode_cdr<interfaces::RosTfMessage>(message.cdr, interfaces::kSmallMessage);
  return tf && !tf->transforms.empty() &&
         std::all_of(tf->transforms.begin(), tf->transforms.end(),
                     [](const auto& transform) { return transform.child_frame_id.starts_with(kFramePrefix); });
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
      {topics.depth, depth_type(topics), TopicQos::kSensor, TopicQos::kImages},
      {topics.color, color_type(topics), TopicQos::kSensor, TopicQos::kImages},
      {topics.camera_info, "sensor_msgs/msg/CameraInfo", TopicQos::kSensor, TopicQos::kReliable},
      {topics.tf, "tf2_msgs/msg/TFMessage", TopicQos::kTf, TopicQos::kTf},
      {topics.tf_static, "tf2_msgs/msg/TFMessage", TopicQos::kTfStatic, TopicQos::kLatched},
      {topics.joint_states, "sensor_msgs/msg/JointState", TopicQos::kJoints, TopicQos::kReliable},
      {topics.clock, "rosgraph_msgs/msg/Clock", TopicQos::kSensor, TopicQos::kReliable},
      {kControlTopic, "std_msgs/msg/String", TopicQos::kCommands, TopicQos::kCommands},
      {kQueryTopic, "std_msgs/msg/String", TopicQos::kCommands, TopicQos::kCommands},
      {kAnswerTopic, "std_msgs/msg/String", TopicQos::kCommands, TopicQos::kReliable},
      {kTypedQueryTopic, "prescene_msgs/msg/Query", TopicQos::kCommands, TopicQos::kCommands},
      {kTypedCancelTopic, "prescene_msgs/msg/Cancel", TopicQos::kCommands, TopicQos::kCommands},
  };
  std::erase_if(rows, [](const BusTopic& row) { return row.name.empty(); });
  return rows;
}

bool is_image_type(const std::string& type) {
  return type == "sensor_msgs/msg/Image" || type == "sensor_msgs/msg/CompressedImage" ||
         type == "sensor_msgs/msg/PointCloud2";
}

interfaces::TopicQos offered_as(const std::string& topic, const std::string& type) {
  using interfaces::TopicQos;
  const std::vector<BusTopic> rows = bus_topics({});
  const auto known = std::find_if(rows.begin(), rows.end(), [&](const BusTopic& row) { return row.name == topic; });
  if (known != rows.end() && known->type == type) return known->write;
  if (is_image_type(type)) return TopicQos::kImages;
  if (type == "tf2_msgs/msg/TFMessage") return topic.ends_with("static") ? TopicQos::kLatched : TopicQos::kTf;
  return TopicQos::kReliable;
}

bool is_parsed_in_recordings(const std::string& topic) {
  return topic == kStepTopic || topic == kTruthTopic || topic == kOutcomeTopic || topic == kHappenedTopic;
}

std::size_t most_json_bytes(const std::string& topic) {
  return is_parsed_in_recordings(topic) ? kMostParsedJsonBytes : interfaces::CdrLimits().max_string_bytes;
}

}  // namespace prescene::service
