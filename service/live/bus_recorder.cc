// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/live/bus_recorder.h"

#include <algorithm>
#include <exception>
#include <string>

#include "prescene/core/clock.h"
#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/service/live/inbox.h"
#include "prescene/service/live/log_limiter.h"
#include "prescene/service/outside_json.h"
#include "prescene/service/tracking/camera_frames.h"
#include "prescene/service/tracking/camera_presets.h"
#include "prescene/service/tracking/topics.h"

namespace prescene::service {
namespace {

/// What is known until a question's answer comes.
bool is_answer_so_far(const interfaces::ReceivedMessage& message) {
  if (message.topic != kAnswerTopic) return false;
  const auto text = interfaces::decode_cdr<interfaces::RosString>(message.cdr);
  return text && text_is_so_far(text->data);
}

constexpr std::chrono::milliseconds kWriteInterval(100);
// What may wait for the disk: two seconds of images of 640 x 480 at 30 Hz.
constexpr InboxLimit kWaitingImages{.messages = 60, .bytes = std::size_t{64} << 20};
constexpr InboxLimit kWaitingTransforms{.messages = 10'000, .bytes = std::size_t{16} << 20};

}  // namespace

core::Result<std::uint64_t> record_topics(const interfaces::DdsOptions& dds, const std::vector<CameraInput>& cameras,
                                          const core::Cancellation& cancellation, const core::LogSink& log,
                                          RollingRecording& recording) {
  std::map<std::string, InboxLimit> limits;
  for (const CameraInput& camera : cameras)
    limits.insert({{camera.topics.depth, kWaitingImages},
                   {camera.topics.color, kWaitingImages},
                   {camera.topics.tf, kWaitingTransforms},
                   {camera.topics.joint_states, kWaitingTransforms}});
  Inbox inbox(limits);
  LogLimiter bus_log(log, {});
  PRESCENE_TRY(const auto node, interfaces::DdsNode::create(dds, bus_log.sink()));
  for (const BusTopic& topic : topics_of_cameras(cameras)) {
    PRESCENE_RETURN_IF_ERROR(
        node->subscribe(topic.name, topic.type, topic.read,
                        [&inbox](interfaces::ReceivedMessage&& message) { inbox.put(std::move(message)); }));
  }
  const std::string domain = "in DDS domain " + std::to_string(dds.domain);
  for (const CameraInput& camera : cameras)
    core::log(log, core::LogLevel::kInfo,
              "recording " + domain + (camera.name.empty() ? "" : " camera " + camera.name) + ": " +
                  topics_text(camera.topics));
  std::uint64_t messages = 0, without_memory = 0;
  core::TimeNs last_ns = 0;
  std::vector<CameraInput> waits_for = cameras;  // those whose depth images have not come
  bool was_late = false;
  const core::Stopwatch watch;
  while (!cancellation.requested()) {
    if (!waits_for.empty() && watch.seconds() > kNothingCameAfter) {
      core::log(log, core::LogLevel::kWarning,
                nothing_came_text(waits_for.front().topics, node->domain_topics(), domain, waits_for.front().name));
      waits_for.erase(waits_for.begin());
    }
    for (interfaces::ReceivedMessage& message : inbox.take_all(std::chrono::steady_clock::now() + kWriteInterval)) {
      // Never back, so that the order by time is the order of arrival.
      message.received_ns = last_ns = std::max(last_ns, message.received_ns);
      std::erase_if(waits_for, [&](const CameraInput& camera) { return camera.topics.depth == message.topic; });
      if (are_of_objects(message) || is_answer_so_far(message)) continue;  // what a service made of all the rest
      ++messages;
      try {
        recording.write(message);
      } catch (const std::exception&) {
        ++without_memory;
      }
    }
    try {
      recording.write_due(core::steady_now_ns());
      if (recording.is_change_due()) recording.change(nullptr);
    } catch (const std::exception& error) {
      core::log(log, core::LogLevel::kWarning, std::string("the recording was not looked after: ") + error.what());
    }
    const bool is_late = recording.seconds_at_risk() > kTooLongAtRisk;
    if (is_late && !was_late)
      core::log(log, core::LogLevel::kWarning,
                "the disk is slow: more than the last second is lost if the power fails");
    was_late = is_late;
  }
  node->stop_receiving();
  if (inbox.dropped() + node->dropped_samples() > 0) {
    core::log(log, core::LogLevel::kWarning,
              std::to_string(inbox.dropped() + node->dropped_samples()) +
                  " messages were lost: the disk or the network is too slow for these topics");
  }
  if (without_memory > 0) {
    core::log(log, core::LogLevel::kWarning,
              std::to_string(without_memory) + " messages were not recorded: there was no memory for them");
  }
  PRESCENE_RETURN_IF_ERROR(recording.close());
  return messages - without_memory;
}

}  // namespace prescene::service
