// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/live_service.h"

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "prescene/core/clock.h"
#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/interfaces/ros_messages/conversions.h"
#include "prescene/service/answering_desk.h"
#include "prescene/service/belief_summary.h"
#include "prescene/service/inbox.h"
#include "prescene/service/service_health.h"

namespace prescene::service {
namespace {

using interfaces::DdsPublisher;
using interfaces::ReceivedMessage;
using interfaces::TopicQos;
using std::chrono::steady_clock;

// How often a stop request is looked for while nothing comes in.
constexpr std::chrono::milliseconds kPollInterval(100);

std::map<std::string, std::size_t> inbox_limits(const InputTopics& topics) {
  return {{topics.depth, 4}, {topics.color, 4}, {topics.camera_info, 4}, {topics.tf, 1000}, {topics.tf_static, 100}};
}

/// True at most `rate` times a second.
class RateLimit {
 public:
  explicit RateLimit(double rate) : interval_(std::chrono::duration<double>(1.0 / rate)) {}
  bool due() {
    const auto now = steady_clock::now();
    if (last_ && now - *last_ < interval_) return false;
    last_ = now;
    return true;
  }

 private:
  std::chrono::duration<double> interval_;
  std::optional<steady_clock::time_point> last_;
};

}  // namespace

struct LiveService::Impl {
  Impl(std::shared_ptr<const belief::Scene> a_scene, const LiveSettings& a_settings, std::unique_ptr<Tracker> a_tracker,
       std::unique_ptr<RecordingWriter> a_recording, core::LogSink a_log)
      : scene(std::move(a_scene)),
        settings(a_settings),
        tracker(std::move(a_tracker)),
        recording(std::move(a_recording)),
        log(std::move(a_log)),
        meshes(marker_meshes(*scene)),
        inbox(inbox_limits(settings.tracker.topics)),
        marker_limit(settings.marker_rate),
        diagnostics_limit(settings.diagnostics_rate) {}

  core::Status join_bus();
  void take_in(std::vector<ReceivedMessage> messages);
  void refuse(const core::Status& status);
  void record(const std::string& topic, const std::string& json);
  void publish(const TrackerStep& step);
  void publish_diagnostics(core::TimeNs now_ns);
  core::TimeNs now();
  ServiceHealth health() const;
  void tell_what_changed(const ServiceHealth& health);
  void say_once(const std::string& text);

  std::shared_ptr<const belief::Scene> scene;
  LiveSettings settings;
  std::unique_ptr<Tracker> tracker;
  std::unique_ptr<RecordingWriter> recording;
  core::LogSink log;
  MarkerMeshes meshes;
  Inbox inbox;
  RateLimit marker_limit;
  RateLimit diagnostics_limit;

  DdsPublisher beliefs, detections, markers, diagnostics, answers;
  std::map<std::string, DdsPublisher> poses;
  MessageIndex next_index = 0;
  core::TimeNs last_now_ns = 0;
  std::uint64_t steps = 0;
  std::uint64_t refused = 0;
  double step_seconds = 0.0;
  std::vector<std::string> degraded;
  std::string last_refusal;
  std::uint64_t not_simulated = 0;
  std::string physics_failure;
  std::set<std::string> said;  // by say_once
  const Backends* backends = nullptr;
  std::optional<core::Stopwatch> since_frame;
  bool was_tracking = false;
  bool was_degraded = false;
  bool told_why_not = false;
  std::mutex answered_mutex;  // guards what the desk hands over to the recording
  std::vector<std::string> answered;

  // Last, so that their threads end before what they use.
  std::unique_ptr<interfaces::DdsNode> node;
  std::unique_ptr<AnsweringDesk> desk;

  ~Impl() {
    if (node) node->stop_receiving();  // no more questions for the desk,
    desk.reset();                      // no more answers for the bus
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
  const auto on_answer = [raw](const std::string&, const std::string& answer) {
    const core::Status published = raw->node->publish(raw->answers, interfaces::RosString{answer});
    if (!published.ok()) core::log(raw->log, core::LogLevel::kWarning, published.message());
    const std::lock_guard lock(raw->answered_mutex);
    raw->answered.push_back(answer);
  };
  PRESCENE_TRY(impl->answers, impl->node->advertise(kAnswerTopic, "std_msgs/msg/String", TopicQos::kReliable));
  impl->desk = std::make_unique<AnsweringDesk>(
      backends, std::max(1, backends.pool().threads() - 1), settings.desk, [raw] { return raw->tracker->belief(); },
      on_answer);
  PRESCENE_RETURN_IF_ERROR(impl->join_bus());
  return std::unique_ptr<LiveService>(new LiveService(std::move(impl)));
}

core::Status LiveService::Impl::join_bus() {
  PRESCENE_TRY(beliefs, node->advertise(kBeliefTopic, "std_msgs/msg/String", TopicQos::kReliable));
  PRESCENE_TRY(detections, node->advertise(kDetectionsTopic, "vision_msgs/msg/Detection3DArray", TopicQos::kReliable));
  PRESCENE_TRY(markers, node->advertise(kMarkersTopic, "visualization_msgs/msg/MarkerArray", TopicQos::kReliable));
  PRESCENE_TRY(diagnostics,
               node->advertise(kDiagnosticsTopic, "diagnostic_msgs/msg/DiagnosticArray", TopicQos::kReliable));
  for (const belief::SceneObject& object : scene->objects) {
    PRESCENE_TRY(
        poses[object.name],
        node->advertise(pose_topic(object.name), "geometry_msgs/msg/PoseWithCovarianceStamped", TopicQos::kReliable));
  }
  const auto deliver = [this](ReceivedMessage&& message) { inbox.put(std::move(message)); };
  const InputTopics& topics = settings.tracker.topics;
  PRESCENE_RETURN_IF_ERROR(node->subscribe(topics.depth, "sensor_msgs/msg/Image", TopicQos::kSensor, deliver));
  if (!topics.color.empty()) {
    PRESCENE_RETURN_IF_ERROR(node->subscribe(topics.color, "sensor_msgs/msg/Image", TopicQos::kSensor, deliver));
  }
  PRESCENE_RETURN_IF_ERROR(
      node->subscribe(topics.camera_info, "sensor_msgs/msg/CameraInfo", TopicQos::kSensor, deliver));
  PRESCENE_RETURN_IF_ERROR(node->subscribe(topics.tf, "tf2_msgs/msg/TFMessage", TopicQos::kTf, deliver));
  PRESCENE_RETURN_IF_ERROR(node->subscribe(topics.tf_static, "tf2_msgs/msg/TFMessage", TopicQos::kTfStatic, deliver));
  PRESCENE_RETURN_IF_ERROR(node->subscribe(kControlTopic, "std_msgs/msg/String", TopicQos::kReliable, deliver));
  return node->subscribe(kQueryTopic, "std_msgs/msg/String", TopicQos::kReliable, [this](ReceivedMessage&& message) {
    const auto question = interfaces::decode_cdr<interfaces::RosString>(message.cdr);
    if (question) desk->ask(question->data);
    inbox.put(std::move(message));  // for the recording
  });
}

core::TimeNs LiveService::Impl::now() {
  // Never back, so that a recording's order by time is the order of arrival.
  last_now_ns = std::max(last_now_ns, core::wall_now_ns());
  return last_now_ns;
}

void LiveService::Impl::refuse(const core::Status& status) {
  ++refused;
  if (status.message() == last_refusal) return;  // a driver repeats its mistake with each frame
  last_refusal = status.message();
  core::log(log, core::LogLevel::kWarning, "message refused: " + last_refusal);
}

void LiveService::Impl::record(const std::string& topic, const std::string& json) {
  if (!recording) return;
  const core::Status written = recording->write_json(topic, json, last_now_ns);
  if (written.ok()) return;
  core::log(log, core::LogLevel::kError, written.message() + "; going on without recording");
  recording.reset();
}

void LiveService::Impl::take_in(std::vector<ReceivedMessage> messages) {
  for (ReceivedMessage& message : messages) {
    message.received_ns = std::max(message.received_ns, last_now_ns);
    last_now_ns = message.received_ns;
    MessageIndex index = next_index++;
    if (recording) {
      const auto written = recording->write(message);
      if (written) {
        index = *written;
      } else {
        core::log(log, core::LogLevel::kError, written.status().message() + "; going on without recording");
        recording.reset();
      }
    }
    const core::Status taken = tracker->take_in(message, index);
    if (!taken.ok()) refuse(taken);
  }
}

void LiveService::Impl::publish(const TrackerStep& step) {
  const std::shared_ptr<const belief::Belief> belief = tracker->belief();
  const BeliefSummary summary = summary_of(*belief);
  const std::string& world = settings.tracker.assembler.world_frame;
  const auto check = [this](const core::Status& status) {
    if (!status.ok()) core::log(log, core::LogLevel::kWarning, status.message());
  };
  const std::string json = to_json(summary).dump();
  check(node->publish(beliefs, interfaces::RosString{json}));
  check(node->publish(detections, detections_of(summary, *belief->scene, world)));
  for (const ObjectSummary& object : summary.objects) {
    const auto publisher = poses.find(object.name);
    if (publisher == poses.end() || object.state == belief::TrackState::kLost) continue;
    check(node->publish(publisher->second, pose_of(object, summary.stamp_ns, world)));
  }
  if (marker_limit.due()) check(node->publish(markers, markers_of(summary, *belief->scene, meshes, world)));
  record(kBeliefTopic, json);
  record(kStepTopic, to_json(step.record).dump());
}

ServiceHealth LiveService::Impl::health() const {
  ServiceHealth health;
  health.depth_topic = settings.tracker.topics.depth;
  health.steps = steps;
  health.skipped_frames = tracker->skipped_count();
  health.refused_messages = refused;
  health.dropped_in_inbox = inbox.dropped();
  health.lost_on_bus = node->dropped_samples();
  if (since_frame) health.seconds_since_frame = since_frame->seconds();
  health.last_step_seconds = step_seconds;
  health.degraded = degraded;
  health.last_skip = tracker->last_skip();
  health.last_refusal = last_refusal;
  health.not_simulated = not_simulated;
  health.physics_failure = physics_failure;
  health.steppers = backends->stepper_counts();
  return health;
}

void LiveService::Impl::say_once(const std::string& text) {
  // Reasons name objects and counts of a scene, so they are few; more than these stand in /diagnostics only.
  constexpr std::size_t kMostSaid = 32;
  if (said.size() < kMostSaid && said.insert(text).second) core::log(log, core::LogLevel::kWarning, text);
}

void LiveService::Impl::tell_what_changed(const ServiceHealth& health) {
  if (!health.physics_failure.empty())
    say_once("physics failed, so what it was to move goes on at constant velocity: " + health.physics_failure);
  if (!health.steppers.last_reason.empty())
    say_once("simulating with Bullet's stepper, which is 3 to 7 times slower than in lockstep: " +
             health.steppers.last_reason);
  const bool tracking = is_tracking(health);
  if (tracking && !was_tracking) {
    core::log(log, core::LogLevel::kInfo, "frames come: " + health_text(health));
  } else if (tracking && !health.degraded.empty() && !was_degraded) {
    core::log(log, core::LogLevel::kWarning, health_text(health));
  } else if (!tracking && (was_tracking || (!told_why_not && !health.last_skip.empty()))) {
    core::log(log, core::LogLevel::kWarning, health_text(health));
    told_why_not = !health.last_skip.empty();
  }
  if (tracking) told_why_not = false;
  was_tracking = tracking;
  was_degraded = !health.degraded.empty();
}

void LiveService::Impl::publish_diagnostics(core::TimeNs now_ns) {
  const ServiceHealth now = health();
  tell_what_changed(now);
  const core::Status sent =
      node->publish(diagnostics, interfaces::RosDiagnosticArray{{interfaces::to_ros_time(now_ns), ""},
                                                                {to_diagnostic(now, settings.dds.node_name)}});
  if (!sent.ok()) core::log(log, core::LogLevel::kWarning, sent.message());
}

core::Status LiveService::run(const core::Cancellation& cancellation) {
  Impl& impl = *impl_;
  core::log(impl.log, core::LogLevel::kInfo,
            "listening in DDS domain " + std::to_string(impl.settings.dds.domain) + " for " +
                impl.settings.tracker.topics.depth);
  while (!cancellation.requested()) {
    auto until = steady_clock::now() + kPollInterval;
    if (const auto deadline = impl.tracker->next_deadline()) {
      until = std::min(
          until, steady_clock::now() + std::chrono::nanoseconds(std::max<core::TimeNs>(0, *deadline - impl.now())));
    }
    impl.take_in(impl.inbox.take_all(until));
    std::vector<std::string> answered;
    {
      const std::lock_guard lock(impl.answered_mutex);
      answered.swap(impl.answered);
    }
    const core::TimeNs now_ns = impl.now();
    for (const std::string& answer : answered) impl.record(kAnswerTopic, answer);
    if (const auto step = impl.tracker->step(now_ns)) {
      ++impl.steps;
      impl.since_frame.emplace();
      impl.step_seconds = step->record.seconds;
      impl.degraded = step->record.degraded;
      impl.not_simulated += static_cast<std::uint64_t>(step->counters.not_simulated);
      if (!step->physics_failure.empty()) impl.physics_failure = step->physics_failure;
      impl.publish(*step);
    }
    if (impl.diagnostics_limit.due()) impl.publish_diagnostics(now_ns);
  }
  core::log(impl.log, core::LogLevel::kInfo, "stopped after " + std::to_string(impl.steps) + " steps");
  return impl.recording ? impl.recording->close() : core::ok_status();
}

}  // namespace prescene::service
