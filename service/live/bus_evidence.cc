// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/live/bus_evidence.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "prescene/interfaces/ros_messages/cdr.h"

namespace prescene::service {
namespace {

using interfaces::ReceivedMessage;

constexpr std::size_t kMostAges = 300;
// Reasons name stamps and frames, so there may be many.
constexpr std::size_t kMostReasons = 50;

/// As the tracker settles it.
AssemblerSettings settled_assembler(const TrackerSettings& settings) {
  AssemblerSettings assembler = settings.assembler;
  assembler.use_color = assembler.use_color && !settings.topics.color.empty();
  assembler.rectified = is_rectified(settings);
  return assembler;
}

}  // namespace

std::optional<double> TopicEvidence::rate() const {
  if (messages < 2 || last_ns <= first_ns) return std::nullopt;
  return static_cast<double>(messages - 1) / core::seconds_of(last_ns - first_ns);
}

BusEvidence::BusEvidence(const TrackerSettings& settings, const belief::Scene* scene, std::string camera)
    : camera_name_(std::move(camera)),
      settings_(settings),
      robot_(scene == nullptr ? std::vector<std::string>() : robot_names(*scene)),
      assembler_(settled_assembler(settings), robot_, settings.tf),
      tf_(settings.tf),
      joints_(settings.assembler.robot) {
  settings_.assembler = settled_assembler(settings);
  const InputTopics& topics = settings_.topics;
  for (const std::string* topic :
       {&topics.depth, &topics.color, &topics.camera_info, &topics.tf, &topics.tf_static, &topics.clock})
    if (!topic->empty()) topics_[*topic];
  if (joints_.has_robot() && !topics.joint_states.empty()) topics_[topics.joint_states];
}

void BusEvidence::note_header(TopicEvidence& topic, const interfaces::RosHeader& header, core::TimeNs wall_ns) {
  topic.frame_id = header.frame_id;
  const auto stamp_ns = interfaces::to_stamp_ns(header.stamp);
  if (!stamp_ns) return;
  if (topic.messages > 1 && *stamp_ns <= topic.stamp_ns) ++topic.stamps_not_later;
  topic.stamp_ns = *stamp_ns;
  if (topic.ages.size() >= kMostAges) return;
  if (settings_.topics.clock.empty())
    topic.ages.push_back(core::seconds_of(wall_ns - *stamp_ns));
  else if (simulated_ns_)
    topic.ages.push_back(core::seconds_of(*simulated_ns_ - *stamp_ns));
}

void BusEvidence::add(const ReceivedMessage& message, core::TimeNs wall_ns) {
  const auto found = topics_.find(message.topic);
  if (found == topics_.end()) return;
  TopicEvidence& topic = found->second;
  if (topic.messages++ == 0) topic.first_ns = message.received_ns;
  topic.last_ns = message.received_ns;
  topic.largest_bytes = std::max(topic.largest_bytes, message.cdr.size());
  const core::Status taken = take_in(message, topic, wall_ns);
  if (taken.ok()) return;
  ++topic.refused;
  topic.last_refusal = taken.message();
}

core::Status BusEvidence::take_in(const ReceivedMessage& message, TopicEvidence& topic, core::TimeNs wall_ns) {
  const MessageIndex index = next_index_++;
  const InputTopics& topics = settings_.topics;
  if (message.topic == topics.clock) {
    PRESCENE_TRY(const auto clock,
                 interfaces::decode_cdr<interfaces::RosClock>(message.cdr, interfaces::kSmallMessage));
    PRESCENE_TRY(const core::TimeNs now_ns, interfaces::to_stamp_ns(clock.clock));
    if (!simulated_ns_) first_simulated_ns_ = now_ns;
    simulated_ns_ = now_ns;
    return core::ok_status();
  }
  if (message.topic == topics.camera_info) {
    PRESCENE_TRY(auto info, interfaces::decode_cdr<interfaces::RosCameraInfo>(message.cdr, interfaces::kSmallMessage));
    note_header(topic, info.header, wall_ns);
    topic.width = static_cast<int>(std::min<std::uint32_t>(info.width, 1U << 20));
    topic.height = static_cast<int>(std::min<std::uint32_t>(info.height, 1U << 20));
    PRESCENE_RETURN_IF_ERROR(assembler_.add_camera_info(info, index));
    interfaces::CameraRules rules;
    rules.rectified = settings_.assembler.rectified.value_or(false);
    interfaces::CameraReport report;
    PRESCENE_TRY(camera_, interfaces::to_camera(info, rules, &report));
    camera_doubts_ = std::move(report.warnings);
    PRESCENE_TRY(lens_, interfaces::to_lens(info, rules, &report));
    std::ranges::move(report.warnings, std::back_inserter(camera_doubts_));
    info_ = std::move(info);
    return core::ok_status();
  }
  if (message.topic == topics.tf || message.topic == topics.tf_static) {
    const bool is_static = message.topic == topics.tf_static;
    PRESCENE_TRY(const auto tf,
                 interfaces::decode_cdr<interfaces::RosTfMessage>(message.cdr, interfaces::kSmallMessage));
    PRESCENE_TRY(const auto transforms, interfaces::to_transforms(tf));
    for (const interfaces::FrameTransform& transform : transforms.accepted) {
      joints_.give_way(transform.child, tf_);
      static_cast<void>(tf_.add(transform.parent, transform.child, transform.stamp_ns, transform.X_PC, is_static));
    }
    return assembler_.add_tf(tf, index, is_static);  // tells what is wrong with them
  }
  if (message.topic == topics.joint_states) {
    PRESCENE_TRY(const auto joints,
                 interfaces::decode_cdr<interfaces::RosJointState>(message.cdr, interfaces::kSmallMessage));
    note_header(topic, joints.header, wall_ns);
    static_cast<void>(joints_.add(joints, settings_.assembler.world_frame, tf_));
    return assembler_.add_joint_state(joints, index);  // tells what is wrong with them
  }
  const auto note_image = [&](const interfaces::RosHeader& header, const auto& image, const std::string& form) {
    note_header(topic, header, wall_ns);
    topic.width = image.width();
    topic.height = image.height();
    topic.encoding = form;
  };
  if (message.topic == topics.color) {
    PRESCENE_TRY(ColorMessage color, decode_color_message(message));
    note_image(color.header, color.color, color.form);
    return assembler_.add_color(std::move(color), index, message.received_ns);
  }
  PRESCENE_TRY(DepthMessage depth, decode_depth(message, assembler_.image_rules()));
  note_image(depth.header, depth.depth, depth.form);
  depth_report_ = depth.report;
  return assembler_.add_depth(std::move(depth), index, message.received_ns);
}

void BusEvidence::take_frames(core::TimeNs now_ns) {
  while (auto frame = assembler_.take(now_ns)) {
    ++frames_;
    frames_with_color_ += frame->color ? 1 : 0;
    newest_ = std::move(frame);
  }
  for (const SkippedFrame& frame : assembler_.take_skipped()) {
    if (skipped_.size() < kMostReasons || skipped_.contains(frame.reason)) ++skipped_[frame.reason];
  }
}

std::string BusEvidence::camera_frame() const {
  if (!settings_.assembler.camera_frame.empty()) return settings_.assembler.camera_frame;
  const auto frame = interfaces::to_frame_id(topics_.at(settings_.topics.depth).frame_id);
  return frame ? *frame : "";
}

}  // namespace prescene::service
