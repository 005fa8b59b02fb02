// SPDX-License-Identifier: Apache-2.0
#include "tests/service/robot_on_bus.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/interfaces/ros_messages/conversions.h"
#include "prescene/service/recording/recording.h"
#include "prescene/service/tracking/topics.h"
#include "tests/support/paths.h"

namespace prescene::tests {
namespace {

using interfaces::DdsNode;
using interfaces::ReceivedMessage;
using interfaces::TopicQos;

constexpr int kMostFrames = 3000;

template <class Message>
Message decoded(const ReceivedMessage& message) {
  auto result = interfaces::decode_cdr<Message>(message.cdr);
  EXPECT_TRUE(result.ok()) << message.topic;
  return result ? *std::move(result) : Message{};
}

/// Hands every robot message of a simulated recording of the scene to `take`.
void record(const std::string& scene_yaml, const std::function<void(const ReceivedMessage&)>& take) {
  const ScratchDir folder;
  const std::filesystem::path path = folder.path() / "run.mcap";
  const core::Status recorded = record_scene(scene_yaml, {}, service::SimulatedRecordingOptions().rate, path);
  ASSERT_TRUE(recorded.ok()) << recorded.message();
  const auto reader = service::RecordingReader::open(path);
  ASSERT_TRUE(reader.ok()) << reader.status().message();
  for (;;) {
    const auto entry = (*reader)->next();
    ASSERT_TRUE(entry.ok()) << entry.status().message();
    if (!*entry) return;
    if (!(*entry)->is_json) take((*entry)->message);
  }
}

}  // namespace

RobotOnBus::RobotOnBus(const std::string& scene_yaml, int domain, service::InputTopics topics)
    : topics_(std::move(topics)) {
  record(scene_yaml, [&](const ReceivedMessage& message) {
    if (message.topic == topics_.depth) depths_.push_back(decoded<interfaces::RosImage>(message));
    if (message.topic == topics_.color) colors_.push_back(decoded<interfaces::RosImage>(message));
    if (message.topic == topics_.camera_info) info_ = decoded<interfaces::RosCameraInfo>(message);
    if (message.topic == topics_.tf_static) camera_pose_ = decoded<interfaces::RosTfMessage>(message);
  });
  EXPECT_FALSE(depths_.empty());
  EXPECT_FALSE(camera_pose_.transforms.empty());
  if (depths_.empty() || depths_.size() != colors_.size()) return;

  interfaces::DdsOptions options;
  options.domain = domain;
  options.node_name = "robot";
  auto node = DdsNode::create(options, {});
  EXPECT_TRUE(node.ok()) << node.status().message();
  if (!node) return;
  const auto keep = [this](std::vector<std::string>& texts) {
    return [this, &texts](ReceivedMessage&& message) {
      const auto text = interfaces::decode_cdr<interfaces::RosString>(message.cdr);
      const std::lock_guard lock(mutex_);
      if (text) texts.push_back(text->data);
      changed_.notify_all();
    };
  };
  const char* const string = "std_msgs/msg/String";
  // With a history of a hundred, as on a busy machine this node's thread may not read for a third of a second.
  EXPECT_TRUE((*node)->subscribe(service::kBeliefTopic, string, TopicQos::kCommands, keep(beliefs_)).ok());
  EXPECT_TRUE((*node)->subscribe(service::kAnswerTopic, string, TopicQos::kCommands, keep(answers_)).ok());
  EXPECT_TRUE((*node)
                  ->subscribe(service::kDiagnosticsTopic, "diagnostic_msgs/msg/DiagnosticArray", TopicQos::kReliable,
                              [this](ReceivedMessage&& message) {
                                const auto array = interfaces::decode_cdr<interfaces::RosDiagnosticArray>(message.cdr);
                                if (!array || array->status.empty()) return;
                                const std::lock_guard lock(mutex_);
                                diagnosis_ = array->status[0].message;
                                for (const auto& entry : array->status[0].values) diagnostics_[entry.key] = entry.value;
                                changed_.notify_all();
                              })
                  .ok());
  node_ = *std::move(node);
}

RobotOnBus::~RobotOnBus() {
  if (node_) node_->stop_receiving();
}

interfaces::DdsPublisher RobotOnBus::publisher(const std::string& topic, const std::string& type, TopicQos qos) {
  const auto found = publishers_.find(topic);
  if (found != publishers_.end()) return found->second;
  const auto made = node_->advertise(topic, type, qos);
  EXPECT_TRUE(made.ok()) << made.status().message();
  return publishers_[topic] = made ? *made : interfaces::DdsPublisher{};
}

void RobotOnBus::count(const core::Status& sent) { unsent_ += sent.ok() ? 0 : 1; }

void RobotOnBus::send_depth(const interfaces::RosImage& image) {
  count(node_->publish(publisher(topics_.depth, "sensor_msgs/msg/Image", TopicQos::kImages), image));
}

void RobotOnBus::send_color(const interfaces::RosImage& image) {
  count(node_->publish(publisher(topics_.color, "sensor_msgs/msg/Image", TopicQos::kImages), image));
}

void RobotOnBus::send_camera_info(const interfaces::RosCameraInfo& info) {
  count(node_->publish(publisher(topics_.camera_info, "sensor_msgs/msg/CameraInfo", TopicQos::kReliable), info));
}

void RobotOnBus::send_tf(const interfaces::RosTfMessage& tf) {
  count(node_->publish(publisher(topics_.tf, "tf2_msgs/msg/TFMessage", TopicQos::kTf), tf));
}

void RobotOnBus::send_clock(core::TimeNs time_ns) {
  count(node_->publish(publisher(service::kClockTopic, "rosgraph_msgs/msg/Clock", TopicQos::kReliable),
                       interfaces::RosClock{interfaces::to_ros_time(time_ns)}));
}

void RobotOnBus::ask(const std::string& question) {
  count(node_->publish(publisher(service::kQueryTopic, "std_msgs/msg/String", TopicQos::kReliable),
                       interfaces::RosString{question}));
}

void RobotOnBus::control(const std::string& json) {
  count(node_->publish(publisher(service::kControlTopic, "std_msgs/msg/String", TopicQos::kReliable),
                       interfaces::RosString{json}));
}

void RobotOnBus::send_frame(core::TimeNs stamp_ns) {
  const interfaces::RosTime stamp = interfaces::to_ros_time(stamp_ns);
  interfaces::RosTfMessage pose = camera_pose_;
  for (auto& transform : pose.transforms) transform.header.stamp = stamp;
  send_tf(pose);
  info_.header.stamp = stamp;
  send_camera_info(info_);
  if (depths_.size() > 1) {
    depths_.erase(depths_.begin());
    colors_.erase(colors_.begin());
  }
  colors_.front().header.stamp = stamp;
  send_color(colors_.front());
  depths_.front().header.stamp = stamp;
  send_depth(depths_.front());
}

bool RobotOnBus::send_until(const std::function<bool()>& done, core::TimeNs stamp_ns, core::TimeNs step_ns) {
  for (int i = 0; i < kMostFrames; ++i) {
    if (done()) return true;
    send_frame(stamp_ns + i * step_ns);
    wait(std::chrono::milliseconds(30));
  }
  return done();
}

std::vector<std::string> RobotOnBus::beliefs() const {
  const std::lock_guard lock(mutex_);
  return beliefs_;
}

std::vector<std::string> RobotOnBus::answers() const {
  const std::lock_guard lock(mutex_);
  return answers_;
}

std::vector<std::string> RobotOnBus::answers_since(std::size_t known) const {
  const std::lock_guard lock(mutex_);
  return {answers_.begin() + static_cast<std::ptrdiff_t>(std::min(known, answers_.size())), answers_.end()};
}

std::vector<std::string> RobotOnBus::take_beliefs() {
  const std::lock_guard lock(mutex_);
  return std::exchange(beliefs_, {});
}

std::vector<std::string> RobotOnBus::take_answers() {
  const std::lock_guard lock(mutex_);
  return std::exchange(answers_, {});
}

std::string RobotOnBus::diagnosis() const {
  const std::lock_guard lock(mutex_);
  return diagnosis_;
}

std::map<std::string, std::string> RobotOnBus::diagnostics() const {
  const std::lock_guard lock(mutex_);
  return diagnostics_;
}

void RobotOnBus::wait(std::chrono::milliseconds at_most) const {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, at_most);
}

}  // namespace prescene::tests
