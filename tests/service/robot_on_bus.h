// SPDX-License-Identifier: Apache-2.0
// A robot with an RGB-D camera on the bus, as the live service meets it: it sends the frames of a simulated recording
// with stamps of the test's choice, and keeps what the service says.
#pragma once

#include <condition_variable>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "prescene/belief/scene.h"
#include "prescene/interfaces/dds/dds_node.h"
#include "prescene/interfaces/ros_messages/messages.h"
#include "prescene/service/tracking/topics.h"
#include "tests/service/recorded_box.h"

namespace prescene::tests {

/// A box at rest on a table, seen by a small camera.
inline const std::string kBoxScene = box_on_table("0.3", ", normal: {position: [0.005, 0.005, 0]}");

class RobotOnBus {
 public:
  /// Records `scene` and joins the bus with the camera of these topics. A failure is a test failure, and good() is
  /// false.
  RobotOnBus(const std::string& scene_yaml, int domain, service::InputTopics topics = {});
  ~RobotOnBus();

  bool good() const { return node_ != nullptr; }

  /// Sends the recording's next frame (the last one again and again): camera pose, camera info, colour and depth.
  void send_frame(core::TimeNs stamp_ns);
  /// Sends frames, the stamps `step_ns` apart from `stamp_ns` on, until `done` or 3000 of them; true if `done`.
  bool send_until(const std::function<bool()>& done, core::TimeNs stamp_ns, core::TimeNs step_ns = 33'000'000);
  void send_depth(const interfaces::RosImage& image);
  void send_color(const interfaces::RosImage& image);
  void send_camera_info(const interfaces::RosCameraInfo& info);
  void send_tf(const interfaces::RosTfMessage& tf);
  void send_clock(core::TimeNs time_ns);
  void ask(const std::string& question);
  void control(const std::string& json);
  /// Those of send_frame().
  const interfaces::RosImage& depth() const { return depths_.front(); }
  const interfaces::RosCameraInfo& camera_info() const { return info_; }

  /// Messages that the middleware did not take: the service did not keep up.
  std::uint64_t unsent() const { return unsent_; }

  /// JSON of what came on /prescene/belief and /prescene/answer so far.
  std::vector<std::string> beliefs() const;
  std::vector<std::string> answers() const;
  /// Without the first `known` ones.
  std::vector<std::string> answers_since(std::size_t known) const;
  /// Those that came since the last call, which are forgotten: for runs of hours.
  std::vector<std::string> take_beliefs();
  std::vector<std::string> take_answers();
  /// The newest diagnostic's text and values; empty before the first.
  std::string diagnosis() const;
  std::map<std::string, std::string> diagnostics() const;
  /// Waits for the next message of the service, at most this long.
  void wait(std::chrono::milliseconds at_most) const;

 private:
  void count(const core::Status& sent);
  interfaces::DdsPublisher publisher(const std::string& topic, const std::string& type, interfaces::TopicQos qos);

  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  std::vector<std::string> beliefs_, answers_;
  std::string diagnosis_;
  std::map<std::string, std::string> diagnostics_;

  std::uint64_t unsent_ = 0;
  service::InputTopics topics_;
  std::vector<interfaces::RosImage> depths_, colors_;
  interfaces::RosCameraInfo info_;
  interfaces::RosTfMessage camera_pose_;
  std::map<std::string, interfaces::DdsPublisher> publishers_;
  std::unique_ptr<interfaces::DdsNode> node_;  // last: its thread ends before what it fills
};

}  // namespace prescene::tests
