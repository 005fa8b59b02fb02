// SPDX-License-Identifier: Apache-2.0
// What the parts of the live service share.
#pragma once

#include <atomic>
#include <chrono>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "parameter_services.h"
#include "prescene/core/clock.h"
#include "prescene/interfaces/bytes/kept_file.h"
#include "prescene/service/belief_summary.h"
#include "prescene/service/live/belief_events.h"
#include "prescene/service/live/inbox.h"
#include "prescene/service/live/live_service.h"
#include "prescene/service/live/log_limiter.h"
#include "prescene/service/live/overlay_publisher.h"
#include "prescene/service/live/planning_scene.h"
#include "prescene/service/live/query_worker.h"
#include "prescene/service/live/service_health.h"
#include "prescene/service/live/service_manager.h"
#include "prescene/service/tracking/camera_frames.h"
#include "service_calls.h"
#include "service_parameters.h"

namespace prescene::service {

/// True at most `rate` times a second; the rate may be set from any thread.
class RateLimit {
 public:
  explicit RateLimit(double rate) : interval_s_(1.0 / rate) {}
  void set_rate(double rate) { interval_s_ = 1.0 / rate; }
  bool due() {
    const auto now = std::chrono::steady_clock::now();
    if (last_ && now - *last_ < std::chrono::duration<double>(interval_s_)) return false;
    last_ = now;
    return true;
  }

 private:
  std::atomic<double> interval_s_;
  std::optional<std::chrono::steady_clock::time_point> last_;
};

struct LiveService::Impl {
  static constexpr const char* kDetectionsType = "vision_msgs/msg/Detection3DArray";
  static constexpr const char* kPosesType = "geometry_msgs/msg/PoseArray";
  static constexpr const char* kMarkersType = "visualization_msgs/msg/MarkerArray";
  static constexpr const char* kTransformsType = "tf2_msgs/msg/TFMessage";
  static constexpr const char* kCollisionType = "moveit_msgs/msg/CollisionObject";
  static constexpr const char* kTypedBeliefType = "prescene_msgs/msg/Belief";
  static constexpr const char* kTypedEventType = "prescene_msgs/msg/Event";
  static constexpr const char* kPoseType = "geometry_msgs/msg/PoseWithCovarianceStamped";

  Impl(std::shared_ptr<const belief::Scene> a_scene, const LiveSettings& a_settings, std::unique_ptr<Tracker> a_tracker,
       std::unique_ptr<RollingRecording> a_recording, core::LogSink a_log);

  core::Status join_bus();
  /// Passes on the lines that matter enough.
  core::LogSink of_level(core::LogSink to) {
    return [this, to = std::move(to)](core::LogLevel level, const std::string& text) {
      if (level >= log_level) core::log(to, level, text);
    };
  }
  ParameterHooks parameter_hooks();
  /// Takes in what came, in its order, and looks after frames in between.
  void take_in(std::vector<interfaces::ReceivedMessage> messages, const core::Cancellation& cancellation);
  void take_in(interfaces::ReceivedMessage& message);
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
  void publish(const interfaces::DdsPublisher& publisher, const std::string& topic, const std::string& type,
               const Message& message, core::TimeNs stamp_ns);
  /// Without one of its steps a recording can't be replayed: it pauses where that can't be written.
  void record_step(const StepRecord& step);
  /// Writes what was kept back, and begins a new file when it is time.
  void look_after_recording(core::TimeNs now_ns);
  /// Has what was learned written if it was not yet, or could not be.
  void keep_learned();
  /// The same from time to time; a failure is logged and published, and tried again.
  void look_after_learned();
  /// Writes what was learned for who called for it, and replies once it is on the disk.
  void look_after_saves();
  /// What a service was called with, as if it had come on a topic: taken in and recorded.
  void put_text(const char* topic, const std::string& text);
  /// Of what the service can do without: nothing, and a warning, where it may not be written.
  std::optional<interfaces::DdsPublisher> advertised_if_allowed(
      const std::string& topic, const std::string& type, const std::string& remedy,
      interfaces::TopicQos qos = interfaces::TopicQos::kState);
  void warn_not_published(const std::string& topic, const core::Status& why, const std::string& remedy);
  /// Steps the belief if a frame is complete, records what was answered, publishes. Whether it made a step: another
  /// camera's frame may be complete already.
  bool look_after_frames();
  /// Counts and logs a message that the middleware did not take.
  void check_sent(const core::Status& status);
  void publish(const TrackerStep& step);
  void publish_events(const std::vector<BeliefEvent>& happened);
  /// The message of prescene_msgs, where somebody reads it or it is recorded.
  void publish_typed_belief(const BeliefSummary& summary);
  void publish_typed_event(const BeliefEvent& event);
  /// Of the pose of an object that was found.
  void advertise_new(const std::string& object);
  /// Publishes whether frames come, where that changed.
  void note_frames();
  void publish_diagnostics();
  core::TimeNs now();
  std::string domain_text() const { return "DDS domain " + std::to_string(settings.dds.domain); }
  ServiceHealth health() const;
  void report_changes(const ServiceHealth& health);
  /// Called on the threads that simulate for questions, on one at a time.
  core::Result<nlohmann::ordered_json> explain(const belief::ExplainQuestion& question,
                                               const queries::QueryContext& context);
  /// Called as explain(), and not while it is.
  core::Result<nlohmann::ordered_json> why(const belief::WhyQuestion& question, const queries::QueryContext& context);
  core::Result<queries::ExplainContext> frames_context(const queries::QueryContext& context);

  std::shared_ptr<const belief::Scene> scene;
  LiveSettings settings;
  std::vector<CameraInput> cameras;
  std::unique_ptr<Tracker> tracker;
  std::unique_ptr<RollingRecording> recording;  // null where none was asked for
  ServiceManager manager{manager_of_environment()};
  std::atomic<core::LogLevel> log_level{core::LogLevel::kInfo};
  LogLimiter log_limiter;
  core::LogSink log;
  MarkerMeshes meshes;
  Inbox inbox;
  RateLimit marker_limit;
  RateLimit diagnostics_limit;
  FrameHistory frames;  // for questions what happened, and why a pose is believed
  RateLimit learned_limit;

  /// Topics of prescene_msgs: those to publish on, before there are questions, ...
  void advertise_typed();
  /// ... and who takes the messages of the others, as std::function for subscribe(); empty for all other topics.
  std::function<void(interfaces::ReceivedMessage&&)> typed_taker(const std::string& topic);
  void take_typed(const core::Result<std::string>& json, const std::string& id, std::uint64_t writer);
  bool is_read(const std::optional<interfaces::DdsPublisher>& publisher) const {
    return publisher && node->matched_readers(*publisher) > 0;
  }
  /// What was said as JSON, as the message that is made of it, where somebody reads it. From any thread.
  template <class Message>
  void publish_typed(const std::optional<interfaces::DdsPublisher>& publisher, Message (*made)(const std::string&),
                     const std::string& json) noexcept;
  void tell_typed_answer(const std::string& json) noexcept;
  void tell_typed_answer_so_far(const std::string& json) noexcept;
  void tell_typed_progress(const std::string& json) noexcept;

  interfaces::DdsPublisher beliefs, detections, markers, diagnostics, answers, answers_so_far;
  std::optional<interfaces::DdsPublisher> transforms, all_poses, events_topic, collisions;
  std::optional<interfaces::DdsPublisher> typed_beliefs, typed_events, typed_answers, typed_answers_so_far,
      typed_progress;
  BeliefEvents events;
  PlanningScene planning;
  std::map<std::string, interfaces::DdsPublisher> poses;
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
  std::unique_ptr<rendering::LikelihoodBatch> explaining;  // of explain() and why(); made when needed
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
  std::unique_ptr<OverlayPublisher> overlay;  // null where none is offered
  std::unique_ptr<QueryWorker> worker;

  ~Impl() {
    if (node) node->stop_receiving();  // no more questions for the worker,
    worker.reset();                    // no more answers for the bus
    history.reset();
    overlay.reset();
  }
};

}  // namespace prescene::service
