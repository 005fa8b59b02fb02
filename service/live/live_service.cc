// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/live/live_service.h"

#include <algorithm>
#include <exception>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "live_service_impl.h"
#include "prescene/belief/json.h"
#include "prescene/core/clock.h"
#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/service/recording/why_answer.h"
#include "prescene/service/tracking/camera_presets.h"

namespace prescene::service {
namespace {

using interfaces::ReceivedMessage;
using interfaces::TopicQos;
using std::chrono::steady_clock;

// How often a stop request is looked for while nothing comes in.
constexpr std::chrono::milliseconds kPollInterval(100);

// A stop, a frame that is complete and the diagnostics wait no longer than this for a crowd of messages to be taken in.
constexpr std::chrono::milliseconds kLongestIntake(20);

// Of images the newest count; what else waits is bounded so that its intake takes some tens of milliseconds.
std::map<std::string, InboxLimit> inbox_limits(const std::vector<CameraInput>& cameras) {
  constexpr std::size_t kMiB = std::size_t{1} << 20;
  const InboxLimit image{.messages = 4, .bytes = 64 * kMiB};
  std::map<std::string, InboxLimit> limits;
  for (const CameraInput& camera : cameras) {
    const InputTopics& topics = camera.topics;
    limits.insert({{topics.depth, image},
                   {topics.color, image},
                   {topics.camera_info, {.messages = 4, .bytes = kMiB}},
                   {topics.tf, {.messages = 1000, .bytes = 4 * kMiB}},
                   {topics.tf_static, {.messages = 100, .bytes = 4 * kMiB}},
                   {topics.joint_states, {.messages = 1000, .bytes = 4 * kMiB}},
                   {topics.clock, {.messages = 4, .bytes = kMiB}}});
  }
  return limits;
}

/// What the service says of its camera is of the first.
LiveSettings of_first_camera(LiveSettings settings, const belief::Scene& scene) {
  settings.tracker.topics = first_topics(settings.tracker, scene);
  return settings;
}

FrameHistorySettings frame_settings(const LiveSettings& settings) {
  FrameHistorySettings frames = settings.frames;
  frames.width = settings.tracker.filter.frame.terms.target_width;
  return frames;
}

}  // namespace

LiveService::Impl::Impl(std::shared_ptr<const belief::Scene> a_scene, const LiveSettings& a_settings,
                        std::unique_ptr<Tracker> a_tracker, std::unique_ptr<RollingRecording> a_recording,
                        core::LogSink a_log)
    : scene(std::move(a_scene)),
      settings(of_first_camera(a_settings, *scene)),
      cameras(camera_inputs(a_settings.tracker, *scene)),
      tracker(std::move(a_tracker)),
      recording(std::move(a_recording)),
      log_limiter(of_level(std::move(a_log)), {}),
      log(log_limiter.sink()),
      meshes(marker_meshes(*scene)),
      inbox(inbox_limits(cameras)),
      marker_limit(settings.marker_rate),
      diagnostics_limit(settings.diagnostics_rate),
      frames(frame_settings(settings)),
      learned_limit(1.0 / settings.learned_interval),
      planning({.supports = settings.planning_supports}) {
  learned_limit.due();  // not before there is a frame
  if (!settings.learned_file.empty()) learned_file = std::make_unique<interfaces::KeptFile>(settings.learned_file);
}

LiveService::LiveService(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
LiveService::~LiveService() = default;

core::Result<std::unique_ptr<LiveService>> LiveService::create(std::shared_ptr<const belief::Scene> scene,
                                                               const LiveSettings& settings, std::uint64_t seed,
                                                               Backends& backends,
                                                               std::unique_ptr<RollingRecording> recording,
                                                               const core::LogSink& log) {
  PRESCENE_TRY(auto tracker, Tracker::create(scene, settings.tracker, seed, backends));
  tracker->prepare();
  auto impl = std::make_unique<Impl>(std::move(scene), settings, std::move(tracker), std::move(recording), log);
  impl->backends = &backends;
  if (settings.planning_scene) impl->planning.prepare(*impl->scene);
  PRESCENE_TRY(impl->node, interfaces::DdsNode::create(settings.dds, impl->log));
  Impl* raw = impl.get();
  const auto on_answer = [raw](const std::string& answer) {  // on several threads
    raw->check_sent(raw->node->publish(raw->answers, interfaces::RosString{answer}));
    {
      const std::lock_guard lock(raw->answered_mutex);
      raw->answered.push_back(answer);
    }
    raw->calls->note_answer(answer);
    raw->tell_typed_answer(answer);
    if (raw->settings.on_answer) raw->settings.on_answer(answer);
  };
  PRESCENE_TRY(impl->answers, impl->node->advertise(kAnswerTopic, "std_msgs/msg/String", TopicQos::kReliable));
  impl->advertise_typed();
  ServiceCalls::Hooks hooks;
  hooks.ask = [raw](const std::string& question, const std::string& client) {
    raw->put_text(kQueryTopic, question);
    raw->worker->ask(question, client);
  };
  hooks.restart = [raw] { raw->put_text(kControlTopic, R"({"restart": true})"); };
  hooks.keeps_learned = impl->learned_file != nullptr;
  impl->calls = std::make_unique<ServiceCalls>(*impl->node, std::move(hooks), impl->log);
  if (const auto progress = impl->advertised_if_allowed(kProgressTopic, "std_msgs/msg/String", ""))
    impl->settings.worker.on_progress = [raw, topic = *progress](const std::string& text) {
      raw->check_sent(raw->node->publish(topic, interfaces::RosString{text}));
      raw->tell_typed_progress(text);
    };
  // By a writer of their own that never waits: whoever does not read them keeps nobody's answer. One that comes after
  // its answer is passed over by who asked. They are not recorded: the answer is.
  PRESCENE_TRY(impl->answers_so_far, impl->node->advertise(kAnswerTopic, "std_msgs/msg/String", TopicQos::kState));
  impl->settings.worker.on_answer_so_far = [raw](const std::string& answer) {
    raw->check_sent(raw->node->publish(raw->answers_so_far, interfaces::RosString{answer}));
    raw->tell_typed_answer_so_far(answer);
  };
  impl->history = std::make_unique<HistoryKeeper>(backends, settings.history);
  impl->settings.worker.timeline = [raw] { return raw->history->timeline(); };
  impl->settings.worker.explain = [raw](const belief::ExplainQuestion& question, const queries::QueryContext& context) {
    return raw->explain(question, context);
  };
  impl->settings.worker.why = [raw](const belief::WhyQuestion& question, const queries::QueryContext& context) {
    return raw->why(question, context);
  };
  impl->worker = std::make_unique<QueryWorker>(
      backends, backends.pool().threads(), impl->settings.worker, [raw] { return raw->tracker->belief(); }, on_answer);
  impl->running = settings.tracker;
  impl->parameters = std::make_unique<ParameterTable>(
      service_parameters(*impl->scene, impl->settings, impl->parameter_hooks()), [raw] {
        // In its place between the robot's messages, so that a recording is replayed to the same bits.
        if (std::exchange(raw->running_changed, false))
          raw->put_text(kSettingsTopic, running_settings_text(raw->running));
      });
  impl->parameter_services =
      std::make_unique<ParameterServices>(*impl->node, *impl->parameters, settings.dds.node_name, impl->log,
                                          [raw](const core::Status& why) { raw->check_sent(why); });
  PRESCENE_RETURN_IF_ERROR(impl->join_bus());
  return std::unique_ptr<LiveService>(new LiveService(std::move(impl)));
}

ParameterHooks LiveService::Impl::parameter_hooks() {
  ParameterHooks hooks;
  hooks.question_seconds = [this](double seconds) { worker->set_default_seconds(seconds); };
  hooks.most_question_seconds = [this](double seconds) { worker->set_most_seconds(seconds); };
  hooks.history = [this](double seconds) { frames.keep(seconds); };
  hooks.marker_rate = [this](double rate) { marker_limit.set_rate(rate); };
  hooks.diagnostics_rate = [this](double rate) { diagnostics_limit.set_rate(rate); };
  hooks.learned_interval = [this](double seconds) { learned_limit.set_rate(1.0 / seconds); };
  hooks.log_level = [this](core::LogLevel level) { log_level = level; };
  const auto of_tracker = [this](auto change) {
    return [this, change](auto value) {
      change(running, value);
      running_changed = true;
    };
  };
  hooks.max_wait = of_tracker([](TrackerSettings& to, double seconds) { to.assembler.max_wait_s = seconds; });
  hooks.max_stamp_difference =
      of_tracker([](TrackerSettings& to, double seconds) { to.assembler.max_stamp_difference_s = seconds; });
  hooks.new_objects = of_tracker([](TrackerSettings& to, bool looks) { to.new_objects = looks; });
  return hooks;
}

std::optional<interfaces::DdsPublisher> LiveService::Impl::advertised_if_allowed(const std::string& topic,
                                                                                 const std::string& type,
                                                                                 const std::string& remedy,
                                                                                 TopicQos qos) {
  auto publisher = node->advertise(topic, type, qos);
  if (publisher) return *publisher;
  warn_not_published(topic, publisher.status(), remedy);
  return std::nullopt;
}

void LiveService::Impl::warn_not_published(const std::string& topic, const core::Status& why,
                                           const std::string& remedy) {
  core::log(log, core::LogLevel::kWarning,
            topic + " is not published: " + why.message() + (remedy.empty() ? ": " : ": " + remedy + " ") +
                "with --security make keys that allow it (docs/reference/security.md)");
}

core::Status LiveService::Impl::join_bus() {
  PRESCENE_TRY(beliefs, node->advertise(kBeliefTopic, "std_msgs/msg/String", TopicQos::kState));
  PRESCENE_TRY(detections, node->advertise(kDetectionsTopic, kDetectionsType, TopicQos::kState));
  PRESCENE_TRY(markers, node->advertise(kMarkersTopic, kMarkersType, TopicQos::kState));
  PRESCENE_TRY(diagnostics,
               node->advertise(kDiagnosticsTopic, "diagnostic_msgs/msg/DiagnosticArray", TopicQos::kState));
  if (settings.publish_tf)
    transforms = advertised_if_allowed(settings.tracker.topics.tf, kTransformsType, "give --no-tf, or");
  all_poses = advertised_if_allowed(kPosesTopic, kPosesType, "");
  events_topic = advertised_if_allowed(kEventsTopic, "std_msgs/msg/String", "", TopicQos::kChanges);
  if (settings.planning_scene)
    collisions =
        advertised_if_allowed(kCollisionTopic, kCollisionType, "leave --planning-scene out, or", TopicQos::kChanges);
  if (settings.overlay_rate > 0.0) {
    auto made = OverlayPublisher::create(*node, *backends, settings.overlay_rate,
                                         [this](const core::Status& why) { check_sent(why); });
    if (made) {
      overlay = *std::move(made);
      for (const auto& [topic, why] : overlay->refused()) warn_not_published(topic, why, "give --overlay-rate 0, or");
    } else {
      warn_not_published(kOverlayTopic, made.status(), "give --overlay-rate 0, or");
    }
  }
  for (const belief::SceneObject& object : scene->objects) {
    PRESCENE_TRY(poses[object.name], node->advertise(pose_topic(object.name), kPoseType, TopicQos::kState));
  }
  const std::function<void(ReceivedMessage &&)> deliver = [this](ReceivedMessage&& message) {
    inbox.put(std::move(message));
  };
  const std::function<void(ReceivedMessage &&)> deliver_question = [this](ReceivedMessage&& message) {
    try {
      auto question = interfaces::decode_cdr<interfaces::RosString>(message.cdr);
      if (question)
        worker->ask((*std::move(question)).data, "writer " + std::to_string(message.writer));
      else
        ++unreadable_questions;
    } catch (const std::exception&) {
      ++unreadable_questions;
    }
    inbox.put(std::move(message));  // for the recording; an exception of it is the node's to count
  };
  PRESCENE_RETURN_IF_ERROR(calls->offer());
  PRESCENE_RETURN_IF_ERROR(parameter_services->offer());
  for (const BusTopic& topic : topics_of_cameras(cameras)) {
    if (topic.name == kAnswerTopic) continue;  // ours
    auto take = typed_taker(topic.name);
    if (!take) take = topic.name == kQueryTopic ? deliver_question : deliver;
    PRESCENE_RETURN_IF_ERROR(node->subscribe(topic.name, topic.type, topic.read, std::move(take)));
  }
  return core::ok_status();
}

core::Result<queries::ExplainContext> LiveService::Impl::frames_context(const queries::QueryContext& context) {
  if (!explaining) {
    PRESCENE_TRY(explaining, backends->make_likelihood());
  }
  return queries::ExplainContext{context, explaining.get(), settings.tracker.filter};
}

core::Result<nlohmann::ordered_json> LiveService::Impl::explain(const belief::ExplainQuestion& question,
                                                                const queries::QueryContext& context) {
  PRESCENE_TRY(PastWindow past, frames.window(question));
  PRESCENE_TRY(queries::ExplainContext explain_context, frames_context(context));
  if (question.stream && !question.id.empty() && settings.worker.on_answer_so_far)
    explain_context.so_far = [this, &question, known = not_explained_yet(past), watch = core::Stopwatch(),
                              cpu = core::process_cpu_seconds(),
                              told = std::optional<core::Stopwatch>()](const queries::ExplainAnswer& so_far) mutable {
      if (told && told->seconds() < kSoFarInterval) return;
      try {
        known.answer = so_far;
        known.seconds = watch.seconds();
        known.cpu_seconds = core::process_cpu_seconds() - cpu;
        nlohmann::ordered_json answer = explain_answer_json(question, known);
        answer["final"] = false;
        settings.worker.on_answer_so_far(belief::json_text(answer));
      } catch (const std::exception&) {  // no reason to end the work
      }
      told.emplace();
    };
  PRESCENE_TRY(const Explained explained,
               explain_past(std::move(past), question, settings.event_weights, explain_context));
  return explain_answer_json(question, explained);
}

core::Result<nlohmann::ordered_json> LiveService::Impl::why(const belief::WhyQuestion& question,
                                                            const queries::QueryContext& context) {
  PRESCENE_TRY(const PastWindow past, frames.window(asked_window(question)));
  PRESCENE_TRY(const queries::ExplainContext explain_context, frames_context(context));
  PRESCENE_TRY(const Reasons reasons, why_past(past, question, explain_context));
  return why_answer_json(question, reasons);
}

core::TimeNs LiveService::Impl::now() {
  // Never back, so that a recording's order by time is the order of arrival.
  last_now_ns = std::max(last_now_ns, core::steady_now_ns());
  return last_now_ns;
}

void LiveService::Impl::refuse(const core::Status& status) {
  ++refused;
  last_refusal = status.message();
  if (last_refusal == logged_refusal) return;  // a driver repeats its mistake with each frame
  if (log_limiter.log(core::LogLevel::kWarning, "message refused: " + last_refusal)) logged_refusal = last_refusal;
}

void LiveService::Impl::note_failure(const std::string& of, const std::exception& error) {
  ++failures;
  last_failure = of + " was left out: " + error.what();
  last_failure_ns = core::steady_now_ns();
  core::log(log, core::LogLevel::kError, last_failure);
}

void LiveService::Impl::note_idle(const IdleControls& idle) {
  if (idle.count == 0) return;
  idle_controls += idle.count;
  last_idle_control = idle.last;
  core::log(log, core::LogLevel::kWarning, std::string(kControlTopic) + ": " + idle.last);
}

void LiveService::Impl::keep_learned() {
  std::string text = interfaces::learned_yaml(tracker->learned());
  if (text == kept_learned && learned_file->status().ok()) return;
  learned_file->put(text);
  kept_learned = std::move(text);
}

void LiveService::Impl::look_after_learned() {
  if (!learned_file) return;
  const std::string failure = learned_file->status().message();
  if (!failure.empty() && learned_failure.empty())
    core::log(log, core::LogLevel::kError, "what was learned could not be kept: " + failure);
  learned_failure = failure;
  if (learned_limit.due()) keep_learned();
}

void LiveService::Impl::look_after_saves() {
  for (interfaces::ServiceRequest& asked : calls->take_saves()) {
    keep_learned();
    saves.push_back(std::move(asked));
  }
  if (saves.empty() || learned_file->is_busy()) return;
  const core::Status kept = learned_file->status();
  for (const interfaces::ServiceRequest& asked : saves)
    calls->reply(asked, kept.ok(), kept.ok() ? "written to " + settings.learned_file.string() : kept.message());
  saves.clear();
}

void LiveService::Impl::put_text(const char* topic, const std::string& text) {
  inbox.put({topic, "std_msgs/msg/String", interfaces::encode_cdr(interfaces::RosString{text}), core::wall_now_ns(),
             core::steady_now_ns()});
}

void LiveService::Impl::take_in(ReceivedMessage& message) {
  message.received_ns = std::max(message.received_ns, last_now_ns);
  last_now_ns = message.received_ns;
  const MessageIndex index = recording ? recording->write(message) : next_index++;
  depth_has_come = depth_has_come || std::any_of(cameras.begin(), cameras.end(), [&](const CameraInput& camera) {
                     return message.topic == camera.topics.depth;
                   });
  const core::TimeNs simulated_before_ns = tracker->simulated_now_ns();
  const core::Status taken = tracker->take_in(message, index);
  if (message.topic == kControlTopic && taken.ok())
    if (const auto text = interfaces::decode_cdr<interfaces::RosString>(message.cdr, interfaces::kSmallMessage))
      frames.add_control(text->data, message.source_ns);
  if (tracker->simulated_now_ns() != simulated_before_ns) since_tick.emplace();
  if (!taken.ok()) refuse(taken);
}

void LiveService::Impl::take_in(std::vector<ReceivedMessage> messages, const core::Cancellation& cancellation) {
  auto look_up = steady_clock::now() + kLongestIntake;
  for (ReceivedMessage& message : messages) {
    if (cancellation.requested()) return;
    try {
      take_in(message);
    } catch (const std::exception& error) {
      note_failure(message.topic, error);
    }
    if (steady_clock::now() < look_up) continue;
    look_after_frames();
    look_up = steady_clock::now() + kLongestIntake;
  }
}

bool LiveService::Impl::look_after_frames() {
  std::vector<std::string> answers_given;
  {
    const std::lock_guard lock(answered_mutex);
    answers_given.swap(answered);
  }
  const core::TimeNs now_ns = now();
  for (const std::string& answer : answers_given) record(kAnswerTopic, answer);
  look_after_recording(now_ns);
  bool stepped = false;
  try {
    if (const auto step = tracker->step(now_ns)) {
      stepped = true;
      record_step(step->record);  // first: whatever fails below, the step was made
      if (step->record.step == 1) worker->begin_session(step->record.stamp_ns);
      ++steps;
      since_frame.emplace();
      simulated_frame_ns = tracker->simulated_now_ns();
      step_seconds = step->record.seconds;
      degraded = step->record.degraded;
      not_simulated += static_cast<std::uint64_t>(step->counters.not_simulated);
      if (!step->physics_failure.empty()) physics_failure = step->physics_failure;
      note_idle(step->idle_controls);
      publish(*step);
      history->note(tracker->belief());
      frames.add(step->observation, tracker->belief());
      if (settings.on_step) settings.on_step(*step, tracker->belief());
    }
  } catch (const std::exception& error) {
    note_failure("a frame", error);
  }
  look_after_learned();
  look_after_saves();
  note_frames();
  if (diagnostics_limit.due()) publish_diagnostics();
  return stepped;
}

void LiveService::ask(std::string question_json) { impl_->worker->ask(std::move(question_json)); }

core::Status LiveService::run(const core::Cancellation& cancellation) {
  Impl& impl = *impl_;
  for (const CameraInput& camera : impl.cameras)
    core::log(impl.log, core::LogLevel::kInfo,
              "listening in " + impl.domain_text() + (camera.name.empty() ? "" : " to camera " + camera.name) + ": " +
                  topics_text(camera.topics));
  bool stepped = false;
  const auto turn = [&] {
    impl.manager.note_turn();
    auto until = steady_clock::now() + kPollInterval;
    if (std::exchange(stepped, false) && impl.cameras.size() > 1) {
      until = steady_clock::now();
    } else if (const auto deadline = impl.tracker->next_deadline()) {
      until = std::min(
          until, steady_clock::now() + std::chrono::nanoseconds(std::max<core::TimeNs>(0, *deadline - impl.now())));
    }
    impl.take_in(impl.inbox.take_all(until), cancellation);
    stepped = impl.look_after_frames();
  };
  while (!cancellation.requested()) {
    try {
      turn();
    } catch (const std::exception& error) {
      impl.note_failure("a turn of the loop", error);
    }
  }
  impl.manager.tell_stopping();
  core::log(impl.log, core::LogLevel::kInfo, "stopped after " + std::to_string(impl.steps) + " steps");
  const core::Status recorded = impl.recording ? impl.recording->close() : core::ok_status();
  if (impl.learned_file) impl.keep_learned();
  const core::Status kept = impl.learned_file ? impl.learned_file->wait() : core::ok_status();
  return recorded.ok() ? kept : recorded;
}

}  // namespace prescene::service
