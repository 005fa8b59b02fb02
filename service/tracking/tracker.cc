// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/tracking/tracker.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "prescene/core/hash.h"
#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/interfaces/ros_messages/conversions.h"

namespace prescene::service {
namespace {

core::Status check_type(const interfaces::ReceivedMessage& message, const char* type) {
  if (message.type == type) return core::ok_status();
  return core::invalid_input("carries " + message.type + ", expected " + type +
                             ": correct the topic's name in the settings");
}

template <class Message>
core::Result<Message> decoded(const interfaces::ReceivedMessage& message, const char* type) {
  PRESCENE_RETURN_IF_ERROR(check_type(message, type));
  return interfaces::decode_cdr<Message>(message.cdr, interfaces::kSmallMessage);
}

/// With what the scene decides where the settings do not.
filter::FilterSettings filter_settings(const TrackerSettings& settings, const belief::Scene& scene) {
  filter::FilterSettings filter = settings.filter;
  filter.augment.new_objects = filter.augment.new_objects || settings.new_objects.value_or(scene.new_objects);
  return filter;
}

std::vector<std::string> degraded_words(const filter::StepResult& result) {
  std::vector<std::string> words;
  if (result.degraded != 0) words.push_back(filter::degraded_text(result.degraded));
  if (!result.frame_status.ok()) words.push_back(result.frame_status.message());
  if (!result.physics_failure.empty()) words.push_back(result.physics_failure);
  if (!result.learning_failure.empty()) words.push_back(result.learning_failure);
  if (!result.rendering_failure.ok()) words.push_back(result.rendering_failure.message());
  return words;
}

std::string words_of(const IdleControls& idle) {
  return idle.count == 1 ? idle.last
                         : std::to_string(idle.count) + " actions of controls change nothing; the last: " + idle.last;
}

}  // namespace

core::Result<std::unique_ptr<Tracker>> Tracker::create(std::shared_ptr<const belief::Scene> scene,
                                                       const TrackerSettings& settings, std::uint64_t seed,
                                                       Backends& backends) {
  PRESCENE_RETURN_IF_ERROR(validate(*scene));
  interfaces::LearnedFile learned;
  if (!settings.learned.empty()) {
    PRESCENE_TRY(learned, interfaces::parse_learned(settings.learned, settings.learned_file));
    PRESCENE_TRY(belief::Scene with_models, interfaces::with_learned_models(*scene, learned));
    scene = std::make_shared<const belief::Scene>(std::move(with_models));
  }
  PRESCENE_TRY(auto physics, interfaces::learned_physics(*scene, learned));
  PRESCENE_TRY(auto renderer, backends.make_renderer());
  PRESCENE_TRY(auto likelihood, backends.make_likelihood());
  return std::unique_ptr<Tracker>(new Tracker(std::move(scene), settings, std::move(learned), std::move(physics), seed,
                                              backends, std::move(renderer), std::move(likelihood)));
}

Tracker::Tracker(std::shared_ptr<const belief::Scene> scene, const TrackerSettings& settings,
                 interfaces::LearnedFile learned, std::vector<belief::PhysicalBelief> physics, std::uint64_t seed,
                 Backends& backends, std::unique_ptr<rendering::Renderer> renderer,
                 std::unique_ptr<rendering::LikelihoodBatch> likelihood)
    : settings_(settings),
      renderer_(std::move(renderer)),
      likelihood_(std::move(likelihood)),
      filter_(*likelihood_, *renderer_, backends.pool(), filter_settings(settings, *scene),
              backends.simulator_factory()),
      frames_(camera_inputs(settings, *scene), robot_names(*scene), settings.tf),
      scene_(std::move(scene)),
      learned_(std::move(learned)),
      physics_(std::move(physics)),
      belief_(std::make_shared<belief::Belief>(start(seed))) {}

belief::Belief Tracker::start(std::uint64_t seed) const {
  belief::Belief belief = filter_.start(scene_, seed);
  for (std::size_t i = 0; i < physics_.size(); ++i) belief.objects[i].physics = physics_[i];
  return belief;
}

std::shared_ptr<const belief::Belief> Tracker::belief() const {
  const std::lock_guard lock(mutex_);
  return belief_;
}

core::Status Tracker::take_in(const interfaces::ReceivedMessage& message, MessageIndex index, DecodedImages images) {
  last_index_ = index;
  const InputTopics& topics = settings_.topics;
  const bool is_simulated = uses_simulated_time();
  const core::TimeNs received_ns = is_simulated ? simulated_now_ns_ : message.received_ns;
  const auto take = [&]() -> core::Status {
    if (is_simulated && message.topic == topics.clock) {
      PRESCENE_TRY(const auto clock, decoded<interfaces::RosClock>(message, "rosgraph_msgs/msg/Clock"));
      PRESCENE_TRY(simulated_now_ns_, interfaces::to_stamp_ns(clock.clock));
      return core::ok_status();
    }
    if (std::optional<core::Status> taken = frames_.take_in(message, index, received_ns, std::move(images)))
      return *std::move(taken);
    if (message.topic == kControlTopic) {
      PRESCENE_RETURN_IF_ERROR(check_type(message, "std_msgs/msg/String"));
      const auto newest_ns = belief_->step > 0 ? std::optional(belief_->stamp_ns) : std::nullopt;
      if (!is_simulated) return controls_.take_in(message, newest_ns);
      return controls_.take_in({message.topic, message.type, message.cdr, received_ns, received_ns}, newest_ns);
    }
    if (message.topic == kSettingsTopic) {
      PRESCENE_TRY(const auto text, decoded<interfaces::RosString>(message, "std_msgs/msg/String"));
      PRESCENE_TRY(settings_, with_running(settings_, text.data));
      frames_.set_waits(settings_.assembler.max_wait_s, settings_.assembler.max_stamp_difference_s);
      filter_.look_for_new_objects(filter_settings(settings_, *scene_).augment.new_objects);
      return core::ok_status();
    }
    return core::ok_status();
  };
  return take().at(message.topic);
}

std::optional<TrackerStep> Tracker::step(core::TimeNs now_ns) {
  std::optional<AssembledFrame> frame = frames_.take(time_at(now_ns));
  return frame ? std::optional(step_with(*std::move(frame), now_ns)) : std::nullopt;
}

std::optional<TrackerStep> Tracker::repeat(const StepRecord& recorded) {
  std::optional<AssembledFrame> frame =
      frames_.take_recorded(recorded.camera, recorded.depth, time_at(recorded.now_ns));
  return frame ? std::optional(step_with(*std::move(frame), recorded.now_ns)) : std::nullopt;
}

void Tracker::resume(const TrackerSnapshot& snapshot) {
  for (const TrackerSnapshot::Taken& frame : snapshot.taken)
    frames_.resume_after(frame.camera, frame.depth, frame.at_ns);
  controls_ = snapshot.controls;
  taken_ = snapshot.taken;
  filter_.measure_cameras_anew();
  const std::lock_guard lock(mutex_);
  belief_ = snapshot.belief;
}

TrackerStep Tracker::step_with(AssembledFrame frame, core::TimeNs now_ns) {
  const core::Stopwatch watch;
  const core::TimeNs stamp_ns = frame.observation.stamp_ns;
  // Cameras that are triggered together take frames at one instant.
  const bool is_at_once = belief_->step > 0 && stamp_ns == belief_->stamp_ns && !belief_->cameras.empty() &&
                          belief_->cameras[static_cast<std::size_t>(frame.observation.camera)].stamp_ns < stamp_ns;
  const bool clock_went_back = belief_->step > 0 && stamp_ns <= belief_->stamp_ns && !is_at_once;
  // What is known only changes at the end, all at once.
  std::shared_ptr<const belief::Belief> before = belief_;
  WaitingControls controls = controls_;
  const bool restarts = controls.take_restart();
  if (clock_went_back || restarts) {  // Nothing is known of the time between.
    before = std::make_shared<const belief::Belief>(start(belief_->seed));
    if (clock_went_back) controls.begin_again();
  }
  // The first frame of a belief predicts nothing, so that no control could act; nor does one at the instant of the
  // last.
  const bool predicts = before->step > 0 && stamp_ns > before->stamp_ns;
  const belief::Control control =
      predicts ? controls.due(before->stamp_ns, stamp_ns) : belief::Control{before->stamp_ns, stamp_ns, {}};
  filter::StepResult result = filter_.step(*before, frame.observation, control);
  if (predicts) controls.forget_due(stamp_ns);
  if (before->step == 0 && result.belief.step > 0) controls.begin_at(stamp_ns);

  TrackerStep step;
  step.record.after = last_index_;
  step.record.now_ns = now_ns;
  step.record.stamp_ns = stamp_ns;
  step.record.camera = frame.observation.camera;
  step.record.depth = frame.depth;
  step.record.color = frame.color;
  step.record.camera_info = frame.camera_info;
  step.record.tf_until = frame.tf_until;
  step.record.skipped = frames_.take_skipped();
  step.record.degraded = degraded_words(result);
  std::ranges::move(frame.doubts, std::back_inserter(step.record.degraded));
  std::ranges::move(frames_.silent(time_at(now_ns)), std::back_inserter(step.record.degraded));
  if (clock_went_back) step.record.degraded.push_back("clock went back: started again");
  if (restarts) step.record.degraded.push_back("started again, as a control asked");
  if (const std::uint64_t dropped = controls.dropped() - controls_.dropped(); dropped > 0)
    step.record.degraded.push_back(std::to_string(dropped) +
                                   " actions of controls were dropped: they were stamped by another clock");
  step.idle_controls = idle_controls(*before->scene, control);
  if (step.idle_controls.count > 0) step.record.degraded.push_back(words_of(step.idle_controls));
  step.record.step = result.belief.step;
  step.record.belief_hash = core::hash_text(belief::content_hash(result.belief));
  step.counters = result.counters;
  step.news = {clock_went_back, restarts, result.counters.inferred_releases, frames_.silent_cameras(time_at(now_ns))};
  step.camera_frame = std::move(frame.camera_frame);
  step.physics_failure = std::move(result.physics_failure);
  step.trace = std::move(result.trace);
  step.supports = std::move(result.supports);
  step.observation = std::move(frame.observation);
  {
    auto next = std::make_shared<const belief::Belief>(std::move(result.belief));
    const std::lock_guard lock(mutex_);
    belief_ = std::move(next);
  }
  controls_ = std::move(controls);
  std::erase_if(taken_, [&](const auto& earlier) { return earlier.camera == step.record.camera; });
  taken_.push_back({step.record.camera, step.record.depth, time_at(now_ns)});
  step.record.seconds = watch.seconds();
  return step;
}

}  // namespace prescene::service
