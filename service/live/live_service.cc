// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/live/live_service.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <exception>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "parameter_services.h"
#include "prescene/belief/json.h"
#include "prescene/core/clock.h"
#include "prescene/interfaces/bytes/kept_file.h"
#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/interfaces/ros_messages/conversions.h"
#include "prescene/service/belief_summary.h"
#include "prescene/service/live/inbox.h"
#include "prescene/service/live/log_limiter.h"
#include "prescene/service/live/query_worker.h"
#include "prescene/service/live/service_health.h"
#include "prescene/service/tracking/camera_frames.h"
#include "prescene/service/tracking/camera_presets.h"
#include "service_calls.h"
#include "service_parameters.h"

namespace prescene::service {
namespace {

using interfaces::DdsPublisher;
using interfaces::ReceivedMessage;
using interfaces::TopicQos;
using std::chrono::steady_clock;

constexpr const char* kDetectionsType = "vision_msgs/msg/Detection3DArray";
constexpr const char* kMarkersType = "visualization_msgs/msg/MarkerArray";
constexpr const char* kPoseType = "geometry_msgs/msg/PoseWithCovarianceStamped";

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

/// True at most `rate` times a second; the rate may be set from any thread.
class RateLimit {
 public:
  explicit RateLimit(double rate) : interval_s_(1.0 / rate) {}
  void set_rate(double rate) { interval_s_ = 1.0 / rate; }
  bool due() {
    const auto now = steady_clock::now();
    if (last_ && now - *last_ < std::chrono::duration<double>(interval_s_)) return false;
    last_ = now;
    return true;
  }

 private:
  std::atomic<double> interval_s_;
  std::optional<steady_clock::time_point> last_;
};

FrameHistorySettings frame_settings(const LiveSettings& settings) {
  FrameHistorySettings frames = settings.frames;
  frames.width = settings.tracker.filter.frame.terms.target_width;
  return frames;
}

}  // namespace

struct LiveService::Impl {
  Impl(std::shared_ptr<const belief::Scene> a_scene, const LiveSettings& a_settings, std::unique_ptr<Tracker> a_tracker,
       std::unique_ptr<RecordingWriter> a_recording, core::LogSink a_log)
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
        learned_limit(1.0 / settings.learned_interval) {
    learned_limit.due();  // not before there is a frame
    if (!settings.learned_file.empty()) learned_file = std::make_unique<interfaces::KeptFile>(settings.learned_file);
  }

  core::Status join_bus();
  /// Passes on the lines that matter enough.
  core::LogSink of_level(core::LogSink to) {
    return [this, to = std::move(to)](core::LogLevel level, const std::string& text) {
      if (level >= log_level) core::log(to, level, text);
    };
  }
  ParameterHooks parameter_hooks();
  /// Takes in what came, in its order, and looks after frames in between.
  void take_in(std::vector<ReceivedMessage> messages, const core::Cancellation& cancellation);
  void take_in(ReceivedMessage& message);
  void refuse(const core::Status& status);
  /// Counts an exception of a library, or the end of memory: what came next may do better.
  void note_failure(const std::string& of, const std::exception& error);
  /// Counts and logs actions of controls that changed nothing.
  void note_idle(const IdleControls& idle);
  void record(const std::string& topic, const std::string& json);
  /// What was published, for those who play the recording.
  template <class Message>
  void record_output(const std::string& topic, const std::string& type, const Message& message, core::TimeNs stamp_ns);
  template <class Message>
  void publish(const DdsPublisher& publisher, const std::string& topic, const std::string& type, const Message& message,
               core::TimeNs stamp_ns);
  /// Without one of its steps a recording can't be replayed: it ends where that can't be written.
  void record_step(const StepRecord& step);
  /// The recording ends here, and is an error of the run.
  void give_up_recording(const core::Status& why);
  /// Has what was learned written if it was not yet, or could not be.
  void keep_learned();
  /// The same from time to time; a failure is logged and published, and tried again.
  void look_after_learned();
  /// Writes what was learned for who called for it, and replies once it is on the disk.
  void look_after_saves();
  /// What a service was called with, as if it had come on a topic: taken in and recorded.
  void put_text(const char* topic, const std::string& text);
  /// Steps the belief if a frame is complete, records what was answered, publishes. Whether it made a step: another
  /// camera's frame may be complete already.
  bool look_after_frames();
  /// Counts and logs a message that the middleware did not take.
  void check_sent(const core::Status& status);
  void publish();
  /// Of the pose of an object that was found.
  void advertise_new(const std::string& object);
  void publish_diagnostics();
  core::TimeNs now();
  std::string domain_text() const { return "DDS domain " + std::to_string(settings.dds.domain); }
  ServiceHealth health() const;
  void report_changes(const ServiceHealth& health);
  /// Called on the thread that simulates for questions.
  core::Result<nlohmann::ordered_json> explain(const belief::ExplainQuestion& question,
                                               const queries::QueryContext& context);

  std::shared_ptr<const belief::Scene> scene;
  LiveSettings settings;
  std::vector<CameraInput> cameras;
  std::unique_ptr<Tracker> tracker;
  std::unique_ptr<RecordingWriter> recording;
  core::Status recording_status;
  std::atomic<core::LogLevel> log_level{core::LogLevel::kInfo};
  LogLimiter log_limiter;
  core::LogSink log;
  MarkerMeshes meshes;
  Inbox inbox;
  RateLimit marker_limit;
  RateLimit diagnostics_limit;
  FrameHistory frames;  // for questions what happened
  RateLimit learned_limit;

  DdsPublisher beliefs, detections, markers, diagnostics, answers;
  std::map<std::string, DdsPublisher> poses;
  MessageIndex next_index = 0;
  core::TimeNs last_now_ns = 0;
  std::uint64_t steps = 0;
  std::uint64_t refused = 0;
  std::uint64_t failures = 0;
  std::atomic<std::uint64_t> unsent{0};
  double step_seconds = 0.0;
  std::vector<std::string> degraded;
  std::string last_refusal;
  std::string logged_refusal;
  std::uint64_t not_simulated = 0;
  std::string physics_failure;
  std::uint64_t idle_controls = 0;
  std::string last_idle_control;
  Backends* backends = nullptr;
  std::unique_ptr<rendering::LikelihoodBatch> explaining;  // of the thread that simulates; made when it is needed
  /// Since the last frame that was used, s; by simulated time where there is one.
  std::optional<double> seconds_since_frame() const;

  std::optional<core::Stopwatch> since_frame;
  core::TimeNs simulated_frame_ns = 0;        // when it was used
  std::optional<core::Stopwatch> since_tick;  // since simulated time went on
  core::Stopwatch since_start;
  bool depth_has_come = false;
  bool reported_no_frames = false;
  bool was_tracking = false;
  bool was_degraded = false;
  bool reported_why_not = false;
  std::mutex answered_mutex;  // guards what the worker hands over to the recording
  std::vector<std::string> answered;
  std::atomic<std::uint64_t> unreadable_questions{0};  // counted on the bus's thread
  std::string last_failure;
  core::TimeNs last_failure_ns = 0;
  std::shared_ptr<const belief::Scene> published_scene;  // whose models' meshes the markers have
  std::unique_ptr<interfaces::KeptFile> learned_file;    // null where none is named
  std::string kept_learned;                              // the text that it was given
  std::string learned_failure;
  std::vector<interfaces::ServiceRequest> saves;  // that wait for the disk
  ServiceHealth last_reported;

  TrackerSettings running;       // as the parameters say it is to be; guarded by their table's lock
  bool running_changed = false;  // the same
  std::unique_ptr<ParameterTable> parameters;

  // Last, so that their threads end before what they use.
  std::unique_ptr<interfaces::DdsNode> node;
  std::unique_ptr<ParameterServices> parameter_services;
  std::unique_ptr<ServiceCalls> calls;
  std::unique_ptr<HistoryKeeper> history;
  std::unique_ptr<QueryWorker> worker;

  ~Impl() {
    if (node) node->stop_receiving();  // no more questions for the worker,
    worker.reset();                    // no more answers for the bus
    history.reset();
  }
};

LiveService::LiveService(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
LiveService::~LiveService() = default;

core::Result<std::unique_ptr<LiveService>> LiveService::create(std::shared_ptr<const belief::Scene> scene,
                                                               const LiveSettings& settings, std::uint64_t seed,
                                                               Backends& backends,
                                                               std::unique_ptr<RecordingWriter> recording,
                                                               const core::LogSink& log) {
  PRESCENE_TRY(auto tracker, Tracker::create(scene, settings.tracker, seed, backends));
  auto impl = std::make_unique<Impl>(std::move(scene), settings, std::move(tracker), std::move(recording), log);
  impl->backends = &backends;
  PRESCENE_TRY(impl->node, interfaces::DdsNode::create(settings.dds, log));
  Impl* raw = impl.get();
  const auto on_answer = [raw](const std::string& answer) {  // on two threads
    raw->check_sent(raw->node->publish(raw->answers, interfaces::RosString{answer}));
    {
      const std::lock_guard lock(raw->answered_mutex);
      raw->answered.push_back(answer);
    }
    raw->calls->note_answer(answer);
    if (raw->settings.on_answer) raw->settings.on_answer(answer);
  };
  PRESCENE_TRY(impl->answers, impl->node->advertise(kAnswerTopic, "std_msgs/msg/String", TopicQos::kReliable));
  ServiceCalls::Hooks hooks;
  hooks.ask = [raw](const std::string& question) {
    raw->put_text(kQueryTopic, question);
    raw->worker->ask(question);
  };
  hooks.restart = [raw] { raw->put_text(kControlTopic, R"({"restart": true})"); };
  hooks.keeps_learned = impl->learned_file != nullptr;
  impl->calls = std::make_unique<ServiceCalls>(*impl->node, std::move(hooks), impl->log);
  impl->history = std::make_unique<HistoryKeeper>(backends, settings.history);
  impl->settings.worker.timeline = [raw] { return raw->history->timeline(); };
  impl->settings.worker.explain = [raw](const belief::ExplainQuestion& question, const queries::QueryContext& context) {
    return raw->explain(question, context);
  };
  impl->worker = std::make_unique<QueryWorker>(
      backends, std::max(1, backends.pool().threads() - 1), impl->settings.worker,
      [raw] { return raw->tracker->belief(); }, on_answer);
  impl->running = settings.tracker;
  impl->parameters = std::make_unique<ParameterTable>(
      service_parameters(*impl->scene, impl->settings, impl->parameter_hooks()), [raw] {
        // In its place between the robot's messages, so that a recording is replayed to the same bits.
        if (std::exchange(raw->running_changed, false))
          raw->put_text(kSettingsTopic, running_settings_text(raw->running));
      });
  impl->parameter_services =
      std::make_unique<ParameterServices>(*impl->node, *impl->parameters, settings.dds.node_name, impl->log);
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

core::Status LiveService::Impl::join_bus() {
  PRESCENE_TRY(beliefs, node->advertise(kBeliefTopic, "std_msgs/msg/String", TopicQos::kState));
  PRESCENE_TRY(detections, node->advertise(kDetectionsTopic, kDetectionsType, TopicQos::kState));
  PRESCENE_TRY(markers, node->advertise(kMarkersTopic, kMarkersType, TopicQos::kState));
  PRESCENE_TRY(diagnostics,
               node->advertise(kDiagnosticsTopic, "diagnostic_msgs/msg/DiagnosticArray", TopicQos::kState));
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
        worker->ask((*std::move(question)).data);
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
    const auto& take = topic.name == kQueryTopic ? deliver_question : deliver;
    PRESCENE_RETURN_IF_ERROR(node->subscribe(topic.name, topic.type, topic.read, take));
  }
  return core::ok_status();
}

core::Result<nlohmann::ordered_json> LiveService::Impl::explain(const belief::ExplainQuestion& question,
                                                                const queries::QueryContext& context) {
  PRESCENE_TRY(PastWindow past, frames.window(question));
  if (!explaining) {
    PRESCENE_TRY(explaining, backends->make_likelihood());
  }
  const queries::ExplainContext explain_context{context, explaining.get(), settings.tracker.filter};
  PRESCENE_TRY(const Explained explained,
               explain_past(std::move(past), question, settings.event_weights, explain_context));
  return explain_answer_json(question, explained);
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

void LiveService::Impl::record(const std::string& topic, const std::string& json) {
  if (!recording) return;
  const core::Status written = recording->write_json(topic, json, last_now_ns);
  if (!written.ok()) give_up_recording(written);
}

template <class Message>
void LiveService::Impl::record_output(const std::string& topic, const std::string& type, const Message& message,
                                      core::TimeNs stamp_ns) {
  if (!recording) return;
  const core::Status written =
      recording->write_output(topic, type, interfaces::encode_cdr(message), stamp_ns, last_now_ns);
  if (!written.ok()) give_up_recording(written);
}

template <class Message>
void LiveService::Impl::publish(const DdsPublisher& publisher, const std::string& topic, const std::string& type,
                                const Message& message, core::TimeNs stamp_ns) {
  check_sent(node->publish(publisher, message));
  record_output(topic, type, message, stamp_ns);
}

void LiveService::Impl::record_step(const StepRecord& step) {
  try {
    record(kStepTopic, belief::json_text(to_json(step)));
  } catch (const std::exception& error) {
    give_up_recording(core::unavailable(std::string("a step could not be recorded: ") + error.what()));
  }
}

void LiveService::Impl::give_up_recording(const core::Status& why) {
  recording_status = why;
  core::log(log, core::LogLevel::kError, why.message() + "; going on without recording");
  recording.reset();
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
  MessageIndex index = next_index++;
  if (recording) {
    const auto written = recording->write(message);
    if (written) {
      index = *written;
    } else {
      give_up_recording(written.status());
    }
  }
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
  if (recording) {
    const core::Status written = recording->write_due(now_ns);
    if (!written.ok()) give_up_recording(written);
  }
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
      publish();
      history->note(tracker->belief());
      frames.add(step->observation, tracker->belief());
      if (settings.on_step) settings.on_step(*step, tracker->belief());
    }
  } catch (const std::exception& error) {
    note_failure("a frame", error);
  }
  look_after_learned();
  look_after_saves();
  if (diagnostics_limit.due()) publish_diagnostics();
  return stepped;
}

void LiveService::Impl::check_sent(const core::Status& status) {
  if (status.ok()) return;
  unsent.fetch_add(1, std::memory_order_relaxed);
  core::log(log, core::LogLevel::kWarning, status.message());
}

void LiveService::Impl::publish() {
  const std::shared_ptr<const belief::Belief> belief = tracker->belief();
  const BeliefSummary summary = summary_of(*belief);
  const std::string& world = settings.tracker.assembler.world_frame;
  const std::string json = belief::json_text(to_json(summary));
  check_sent(node->publish(beliefs, interfaces::RosString{json}));
  const core::TimeNs stamp_ns = summary.stamp_ns;
  publish(detections, kDetectionsTopic, kDetectionsType, detections_of(summary, *belief->scene, world), stamp_ns);
  if (belief->scene != published_scene) {
    add_marker_meshes(*belief->scene, meshes);
    published_scene = belief->scene;
  }
  for (const ObjectSummary& object : summary.objects) {
    if (object.state == belief::TrackState::kLost) continue;
    advertise_new(object.name);
    const auto publisher = poses.find(object.name);
    if (publisher == poses.end()) continue;
    publish(publisher->second, pose_topic(object.name), kPoseType, pose_of(object, stamp_ns, world), stamp_ns);
  }
  if (marker_limit.due())
    publish(markers, kMarkersTopic, kMarkersType, markers_of(summary, *belief->scene, meshes, world), stamp_ns);
  // On the bus it would come back as the robot's.
  record_output(settings.tracker.topics.tf, "tf2_msgs/msg/TFMessage", transforms_of(summary, world), stamp_ns);
  record(kBeliefTopic, json);
}

void LiveService::Impl::advertise_new(const std::string& object) {
  if (poses.contains(object)) return;
  auto publisher = node->advertise(pose_topic(object), kPoseType, TopicQos::kState);
  if (publisher)
    poses.emplace(object, *std::move(publisher));
  else
    check_sent(publisher.status());
}

std::optional<double> LiveService::Impl::seconds_since_frame() const {
  if (!since_frame) return std::nullopt;
  if (!tracker->uses_simulated_time()) return since_frame->seconds();
  return std::max(0.0, core::seconds_of(tracker->simulated_now_ns() - simulated_frame_ns));
}

ServiceHealth LiveService::Impl::health() const {
  ServiceHealth health;
  for (const CameraInput& camera : cameras)
    health.depth_topic += (health.depth_topic.empty() ? "" : " and ") + camera.topics.depth;
  health.cameras = tracker->cameras_text();
  if (!depth_has_come && since_start.seconds() > kNothingCameAfter)
    health.nothing_came =
        nothing_came_text(settings.tracker.topics, node->domain_topics(), "in " + domain_text(), cameras.front().name);
  health.steps = steps;
  health.skipped_frames = tracker->skipped_count();
  health.refused_messages = refused;
  health.dropped_in_inbox = inbox.dropped_by_topic();
  const InputTopics& topics = settings.tracker.topics;
  health.image_topics = {topics.clock};
  for (const CameraInput& camera : cameras)
    health.image_topics.insert(health.image_topics.end(),
                               {camera.topics.depth, camera.topics.color, camera.topics.camera_info});
  health.lost_on_bus = node->dropped_samples();
  health.unsent = unsent.load(std::memory_order_relaxed);
  health.unlogged = log_limiter.held_back();
  health.tf_forgotten = tracker->tf_forgotten();
  health.tf_late = tracker->tf_late();
  health.waiting_controls = tracker->waiting_controls();
  health.dropped_controls = tracker->dropped_controls();
  health.idle_controls = idle_controls;
  health.last_idle_control = last_idle_control;
  health.other_services = node->other_writers(kBeliefTopic);
  health.is_recording = recording != nullptr;
  if (recording) health.recording_at_risk_s = recording->seconds_at_risk();
  if (!recording_status.ok()) health.recording_failure = recording_status.message();
  health.keeps_learned = !settings.learned_file.empty();
  health.learned_failure = learned_failure;
  health.questions = worker->counts();
  health.unreadable_questions = unreadable_questions;
  health.failures = failures;
  health.last_failure = last_failure;
  health.last_failure_ns = last_failure_ns;
  health.seconds_since_frame = seconds_since_frame();
  health.clock_topic = topics.clock;
  health.simulated_now_s = core::seconds_of(tracker->simulated_now_ns());
  if (since_tick) health.seconds_since_tick = since_tick->seconds();
  health.last_step_seconds = step_seconds;
  health.lens = tracker->lens_text();
  health.degraded = degraded;
  health.last_skip = tracker->last_skip();
  health.last_refusal = last_refusal;
  health.not_simulated = not_simulated;
  health.physics_failure = physics_failure;
  health.steppers = backends->stepper_counts();
  return health;
}

void LiveService::Impl::report_changes(const ServiceHealth& health) {
  if (!health.physics_failure.empty())
    log_limiter.log_once(
        core::LogLevel::kWarning,
        "physics failed, so what it was to move goes on at constant velocity: " + health.physics_failure);
  if (!health.steppers.last_reason.empty())
    log_limiter.log_once(core::LogLevel::kWarning,
                         "simulating with Bullet's stepper, which is 3 to 7 times slower than in lockstep: " +
                             health.steppers.last_reason);
  if (health.other_services > 0) log_limiter.log_once(core::LogLevel::kWarning, others_text(health.other_services));
  if (!health.nothing_came.empty() && !reported_no_frames)
    reported_no_frames = log_limiter.log(core::LogLevel::kWarning, health.nothing_came);
  // What the log holds back is said at the next look, if it is still so then.
  const bool tracking = is_tracking(health);
  if (tracking && !was_tracking) {
    if (!log_limiter.log(core::LogLevel::kInfo, "frames come: " + health_text(health))) return;
  } else if (tracking && !health.degraded.empty() && !was_degraded) {
    if (!log_limiter.log(core::LogLevel::kWarning, health_text(health))) return;
  } else if (!tracking && (was_tracking || (!reported_why_not && !health.last_skip.empty()))) {
    if (!log_limiter.log(core::LogLevel::kWarning, health_text(health))) return;
    reported_why_not = !health.last_skip.empty();
  }
  if (tracking) reported_why_not = false;
  was_tracking = tracking;
  was_degraded = !health.degraded.empty();
}

void LiveService::Impl::publish_diagnostics() {
  const ServiceHealth now = health();
  const core::TimeNs stamp_ns = tracker->uses_simulated_time() ? tracker->simulated_now_ns() : core::wall_now_ns();
  report_changes(now);
  check_sent(node->publish(
      diagnostics, interfaces::RosDiagnosticArray{{interfaces::to_ros_time(stamp_ns), ""},
                                                  {to_diagnostic(now, last_reported, settings.dds.node_name)}}));
  if (settings.on_health) settings.on_health(health_text(now));
  last_reported = now;
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
  core::log(impl.log, core::LogLevel::kInfo, "stopped after " + std::to_string(impl.steps) + " steps");
  const core::Status recorded = impl.recording ? impl.recording->close() : impl.recording_status;
  if (impl.learned_file) impl.keep_learned();
  const core::Status kept = impl.learned_file ? impl.learned_file->wait() : core::ok_status();
  return recorded.ok() ? kept : recorded;
}

}  // namespace prescene::service
