// SPDX-License-Identifier: Apache-2.0
// What came on the topics that the service would read, and what it says of camera, tf and clocks. Reads no clock and
// owns no thread.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "prescene/belief/scene.h"
#include "prescene/interfaces/ros_messages/conversions.h"
#include "prescene/service/live/doctor.h"
#include "prescene/service/tracking/frame_assembler.h"

namespace prescene::service {

/// Of one topic.
struct TopicEvidence {
  std::uint64_t messages = 0;
  core::TimeNs first_ns = 0, last_ns = 0;  ///< When the first and the last came.
  std::size_t largest_bytes = 0;
  std::uint64_t refused = 0;  ///< Messages that made no sense, ...
  std::string last_refusal;   ///< ... and why the last one did not.
  // Of those with a header:
  std::string frame_id;                ///< Of the last one.
  core::TimeNs stamp_ns = 0;           ///< The same.
  std::uint64_t stamps_not_later = 0;  ///< Messages whose stamp was not after the one before.
  std::vector<double> ages;  ///< Time of arrival, wall or simulated, minus stamp, s; of the first few hundred.
  // Of images, the last one's:
  int width = 0, height = 0;
  std::string encoding;

  /// Messages a second; nothing before the second message.
  std::optional<double> rate() const;
};

/// Listens to one camera instead of the tracker, with the same frame assembler.
class BusEvidence {
 public:
  /// `scene` may be null. `camera`: its name if the scene file lists it, and so says what options say else.
  BusEvidence(const TrackerSettings& settings, const belief::Scene* scene, std::string camera = "");

  /// A message of one of the input topics, with the wall time when it came.
  void add(const interfaces::ReceivedMessage& message, core::TimeNs wall_ns);
  /// Takes frames that are complete, or whose time is over.
  void take_frames(core::TimeNs now_ns);

  /// By topic; every input topic has an entry.
  const std::map<std::string, TopicEvidence>& topics() const { return topics_; }
  const TrackerSettings& settings() const { return settings_; }
  const std::string& camera_name() const { return camera_name_; }
  /// Frames that the service would have used, with those of them that had colour, and why others were not used, with
  /// the number of frames.
  std::uint64_t frames() const { return frames_; }
  std::uint64_t frames_with_color() const { return frames_with_color_; }
  const std::map<std::string, std::uint64_t>& skipped() const { return skipped_; }
  /// The newest frame, straightened.
  const std::optional<AssembledFrame>& newest() const { return newest_; }
  /// The last camera info that could be read, and the camera and lens that it describes.
  const std::optional<interfaces::RosCameraInfo>& camera_info() const { return info_; }
  const std::optional<geometry::PinholeCamera>& camera() const { return camera_; }
  const geometry::LensDistortion& lens() const { return lens_; }
  const std::vector<std::string>& camera_doubts() const { return camera_doubts_; }
  std::string lens_text() const { return assembler_.lens_text(); }
  /// Of the last depth image that could be read.
  const interfaces::DepthImageReport& depth_report() const { return depth_report_; }
  /// With the transforms that follow from joint states.
  const TfBuffer& tf() const { return tf_; }
  const JointTransforms& joints() const { return joints_; }
  /// What the clock of simulated time said last, and first; nothing: it is not asked for, or has not come.
  std::optional<core::TimeNs> simulated_ns() const { return simulated_ns_; }
  core::TimeNs first_simulated_ns() const { return first_simulated_ns_; }
  /// The robot bodies of the scene.
  const std::vector<std::string>& robot() const { return robot_; }
  /// The frame that the camera's pose is asked for: that of the settings or of the depth image.
  std::string camera_frame() const;

 private:
  void note_header(TopicEvidence& topic, const interfaces::RosHeader& header, core::TimeNs wall_ns);
  core::Status take_in(const interfaces::ReceivedMessage& message, TopicEvidence& topic, core::TimeNs wall_ns);

  std::string camera_name_;
  TrackerSettings settings_;
  std::vector<std::string> robot_;
  FrameAssembler assembler_;
  TfBuffer tf_;
  JointTransforms joints_;
  std::map<std::string, TopicEvidence> topics_;
  MessageIndex next_index_ = 0;
  std::optional<core::TimeNs> simulated_ns_;
  core::TimeNs first_simulated_ns_ = 0;
  std::uint64_t frames_ = 0, frames_with_color_ = 0;
  std::map<std::string, std::uint64_t> skipped_;
  std::optional<AssembledFrame> newest_;
  std::optional<interfaces::RosCameraInfo> info_;
  std::optional<geometry::PinholeCamera> camera_;
  geometry::LensDistortion lens_;
  std::vector<std::string> camera_doubts_;
  interfaces::DepthImageReport depth_report_;
};

/// What the machine and the middleware say.
struct BusSurroundings {
  int domain = 0;
  std::string interfaces;  ///< As DdsNode::interfaces().
  int participants = 0;
  int other_services = 0;
  std::vector<interfaces::DomainTopic> topics;
  std::optional<int> granted_buffer;  ///< Bytes, of the buffer that was asked for.
  int asked_buffer = 0;
  std::uint64_t lost_datagrams = 0;        ///< By all programs of the machine while it listened, for want of buffer.
  std::map<std::string, std::string> ros;  ///< Environment variables of ROS that keep its nodes to this machine.
};

/// The checks that need no scene, in the order in which they are told. Of several cameras (at least one) those of one
/// after the other, and what they have in common; what keeps one from being used is a warning while another one is.
std::vector<DoctorCheck> checks_of(std::span<const BusEvidence> cameras, const BusSurroundings& around);
inline std::vector<DoctorCheck> checks_of(const BusEvidence& evidence, const BusSurroundings& around) {
  return checks_of(std::span(&evidence, 1), around);
}

}  // namespace prescene::service
