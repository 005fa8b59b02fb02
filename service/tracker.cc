// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/tracker.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>
#include <type_traits>
#include <utility>

#include "prescene/belief/json.h"
#include "prescene/core/hash.h"
#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/service/outside_json.h"

namespace prescene::service {
namespace {

// More than a robot does between two frames; a sender in a loop must not fill the memory.
constexpr std::size_t kMaxControls = 1000;

// A control that was sent so near to the newest frame's stamp was sent by the clock of the frames. Otherwise that clock
// is another one (a simulated time, a camera's own), or was set; then the control counts from the newest frame.
constexpr core::TimeNs kSameClockNs = 2'000'000'000;

// The end of ROS's 32 bit seconds.
constexpr core::TimeNs kLatestStamp = (core::TimeNs{1} << 31) * 1'000'000'000;

template <class Message>
core::Result<Message> decoded(const interfaces::ReceivedMessage& message, const char* type) {
  if (message.type != type) {
    return core::invalid_input("carries " + message.type + ", expected " + type +
                               ": correct the topic's name in the settings");
  }
  const bool large = std::is_same_v<Message, interfaces::RosImage>;
  return interfaces::decode_cdr<Message>(message.cdr, large ? interfaces::CdrLimits{} : interfaces::kSmallMessage);
}

/// Frames do not wait for the colour of a topic that nobody named.
TrackerSettings settled(TrackerSettings settings) {
  settings.assembler.use_color = settings.assembler.use_color && !settings.topics.color.empty();
  return settings;
}

std::vector<std::string> degraded_words(const filter::StepResult& result) {
  std::vector<std::string> words;
  if (result.degraded != 0) words.push_back(filter::degraded_text(result.degraded));
  if (!result.frame_status.ok()) words.push_back(result.frame_status.message());
  if (!result.physics_failure.empty()) words.push_back(result.physics_failure);
  if (!result.rendering_failure.ok()) words.push_back(result.rendering_failure.message());
  return words;
}

}  // namespace

core::Result<std::unique_ptr<Tracker>> Tracker::create(std::shared_ptr<const belief::Scene> scene,
                                                       const TrackerSettings& settings, std::uint64_t seed,
                                                       Backends& backends) {
  PRESCENE_RETURN_IF_ERROR(validate(*scene));
  PRESCENE_TRY(auto renderer, backends.make_renderer());
  PRESCENE_TRY(auto likelihood, backends.make_likelihood());
  return std::unique_ptr<Tracker>(
      new Tracker(std::move(scene), settings, seed, backends, std::move(renderer), std::move(likelihood)));
}

Tracker::Tracker(std::shared_ptr<const belief::Scene> scene, const TrackerSettings& settings, std::uint64_t seed,
                 Backends& backends, std::unique_ptr<rendering::Renderer> renderer,
                 std::unique_ptr<rendering::LikelihoodBatch> likelihood)
    : settings_(settled(settings)),
      renderer_(std::move(renderer)),
      likelihood_(std::move(likelihood)),
      filter_(*likelihood_, *renderer_, backends.pool(), settings.filter, backends.simulator_factory()),
      assembler_(settings_.assembler, robot_names(*scene), settings.tf),
      scene_(std::move(scene)),
      belief_(std::make_shared<belief::Belief>(filter_.start(scene_, seed))) {}

std::shared_ptr<const belief::Belief> Tracker::belief() const {
  const std::lock_guard lock(mutex_);
  return belief_;
}

core::Status Tracker::take_in(const interfaces::ReceivedMessage& message, MessageIndex index) {
  last_index_ = index;
  const InputTopics& topics = settings_.topics;
  const auto take = [&]() -> core::Status {
    if (message.topic == topics.depth) {
      PRESCENE_TRY(const auto image, decoded<interfaces::RosImage>(message, "sensor_msgs/msg/Image"));
      return assembler_.add_depth(image, index, message.received_ns);
    }
    if (message.topic == topics.color) {
      PRESCENE_TRY(const auto image, decoded<interfaces::RosImage>(message, "sensor_msgs/msg/Image"));
      return assembler_.add_color(image, index, message.received_ns);
    }
    if (message.topic == topics.camera_info) {
      PRESCENE_TRY(const auto info, decoded<interfaces::RosCameraInfo>(message, "sensor_msgs/msg/CameraInfo"));
      return assembler_.add_camera_info(info, index);
    }
    if (message.topic == topics.tf || message.topic == topics.tf_static) {
      PRESCENE_TRY(const auto tf, decoded<interfaces::RosTfMessage>(message, "tf2_msgs/msg/TFMessage"));
      return assembler_.add_tf(tf, index, message.topic == topics.tf_static);
    }
    if (message.topic == kControlTopic) return take_control(message);
    return core::ok_status();
  };
  return take().at(message.topic);
}

core::Status Tracker::take_control(const interfaces::ReceivedMessage& message) {
  PRESCENE_TRY(const auto text, decoded<interfaces::RosString>(message, "std_msgs/msg/String"));
  PRESCENE_TRY(const auto actions, parse_control(text.data, sent_at(message)));
  if (controls_.size() + actions.size() > kMaxControls) {
    return core::resource_exhausted("more than " + std::to_string(kMaxControls) +
                                    " actions wait for a frame: send fewer");
  }
  controls_.insert(controls_.end(), actions.begin(), actions.end());
  std::stable_sort(controls_.begin(), controls_.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  return core::ok_status();
}

core::TimeNs Tracker::sent_at(const interfaces::ReceivedMessage& message) const {
  const core::TimeNs sent_ns = message.source_ns > 0 ? message.source_ns : message.received_ns;
  if (belief_->step == 0) return sent_ns;
  const bool is_same_clock = std::abs(sent_ns - belief_->stamp_ns) <= kSameClockNs;
  return is_same_clock ? sent_ns : belief_->stamp_ns;
}

void Tracker::start_again() {
  // What waits was meant for a time that the old clock did not reach.
  std::erase_if(controls_, [&](const auto& entry) { return entry.first > belief_->stamp_ns; });
  auto fresh = std::make_shared<const belief::Belief>(filter_.start(scene_, belief_->seed));
  const std::lock_guard lock(mutex_);
  belief_ = std::move(fresh);
}

belief::Control Tracker::control_until(core::TimeNs stamp_ns) {
  belief::Control control;
  control.begin_ns = belief_->stamp_ns;
  control.end_ns = stamp_ns;
  const auto due =
      std::find_if(controls_.begin(), controls_.end(), [&](const auto& entry) { return entry.first > stamp_ns; });
  for (auto entry = controls_.begin(); entry != due; ++entry) {
    belief::Action action = entry->second;
    action.time = std::max(0.0, core::seconds_of(entry->first - control.begin_ns));
    control.actions.push_back(std::move(action));
  }
  controls_.erase(controls_.begin(), due);
  return control;
}

std::optional<TrackerStep> Tracker::step(core::TimeNs now_ns) {
  std::optional<AssembledFrame> frame = assembler_.take(now_ns);
  if (!frame) return std::nullopt;
  const core::Stopwatch watch;
  const bool clock_went_back = belief_->step > 0 && frame->observation.stamp_ns <= belief_->stamp_ns;
  if (clock_went_back) start_again();
  const belief::Control control = control_until(frame->observation.stamp_ns);
  filter::StepResult result = filter_.step(*belief_, frame->observation, control);

  TrackerStep step;
  step.record.after = last_index_;
  step.record.now_ns = now_ns;
  step.record.stamp_ns = frame->observation.stamp_ns;
  step.record.depth = frame->depth;
  step.record.color = frame->color;
  step.record.camera_info = frame->camera_info;
  step.record.tf_until = frame->tf_until;
  step.record.skipped = assembler_.take_skipped();
  step.record.degraded = degraded_words(result);
  std::ranges::move(frame->doubts, std::back_inserter(step.record.degraded));
  if (clock_went_back) step.record.degraded.push_back("clock went back: started again");
  step.record.step = result.belief.step;
  step.record.belief_hash = core::hash_text(belief::content_hash(result.belief));
  step.counters = result.counters;
  step.physics_failure = std::move(result.physics_failure);
  step.trace = std::move(result.trace);
  step.supports = std::move(result.supports);
  step.observation = std::move(frame->observation);
  {
    auto next = std::make_shared<const belief::Belief>(std::move(result.belief));
    const std::lock_guard lock(mutex_);
    belief_ = std::move(next);
  }
  step.record.seconds = watch.seconds();
  return step;
}

core::Result<std::vector<std::pair<core::TimeNs, belief::Action>>> parse_control(const std::string& text,
                                                                                 core::TimeNs sent_ns) {
  const auto json = parse_or_discard(text);
  if (!json.is_object() || !json.contains("actions") || !json["actions"].is_array()) {
    return core::invalid_input("a control is {\"stamp_ns\": n, \"actions\": [...]}, this one is not");
  }
  core::TimeNs begin_ns = sent_ns;
  if (json.contains("stamp_ns")) {
    if (!json["stamp_ns"].is_number_integer())
      return core::invalid_input("stamp_ns: not a whole number of nanoseconds");
    begin_ns = json["stamp_ns"].get<core::TimeNs>();
    if (begin_ns < 0 || begin_ns > kLatestStamp)
      return core::invalid_input("stamp_ns: a time from 1970 to 2038 is needed, as in ROS headers");
  }
  std::vector<std::pair<core::TimeNs, belief::Action>> actions;
  for (const auto& value : json["actions"]) {
    PRESCENE_TRY(belief::Action action, belief::action_from_json(value));
    // An hour bounds what is plausible, and keeps the sum in range.
    if (!(std::abs(action.time) <= 3600.0))
      return core::invalid_input("time: actions start within an hour of their control");
    actions.emplace_back(begin_ns + static_cast<core::TimeNs>(std::llround(action.time * 1e9)), std::move(action));
  }
  return actions;
}

}  // namespace prescene::service
