// SPDX-License-Identifier: Apache-2.0
// What the service tells: beliefs and what is made of them, the recording, and how it is.
#include <algorithm>
#include <exception>
#include <nlohmann/json.hpp>
#include <string>

#include "live_service_impl.h"
#include "prescene/belief/json.h"
#include "prescene/core/clock.h"
#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/interfaces/ros_messages/conversions.h"
#include "prescene/service/belief_summary.h"
#include "prescene/service/live/typed_messages.h"
#include "prescene/service/tracking/camera_presets.h"

namespace prescene::service {

using interfaces::DdsPublisher;
using interfaces::TopicQos;

void LiveService::Impl::record(const std::string& topic, const std::string& json) {
  if (recording) recording->write_json(topic, json, last_now_ns);
}

template <class Message>
void LiveService::Impl::record_output(const std::string& topic, const std::string& type, const Message& message,
                                      core::TimeNs stamp_ns) {
  if (!recording || !recording->is_on()) return;
  recording->write_output(topic, type, interfaces::encode_cdr(message), stamp_ns, last_now_ns);
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
    if (recording) recording->fail(core::unavailable(std::string("a step could not be recorded: ") + error.what()));
  }
}

void LiveService::Impl::look_after_recording(core::TimeNs now_ns) {
  if (!recording) return;
  try {
    recording->write_due(now_ns);
    if (const auto oldest = tracker->oldest_needed()) recording->need_images_from(*oldest);
    if (!recording->is_change_due()) return;
    tracker->measure_cameras_anew();
    recording->change([snapshot = tracker->snapshot(), scene_of_it = tracker->scene()] {
      return snapshot_text(snapshot, scene_of_it);
    });
  } catch (const std::exception& error) {
    note_failure("what the recording needs", error);
  }
}

void LiveService::Impl::check_sent(const core::Status& status) {
  if (status.ok()) return;
  unsent.fetch_add(1, std::memory_order_relaxed);
  core::log(log, core::LogLevel::kWarning, status.message());
}

void LiveService::Impl::publish_events(const std::vector<BeliefEvent>& happened) {
  for (const BeliefEvent& event : happened) {
    const std::string json = belief::json_text(to_json(event));
    if (events_topic) check_sent(node->publish(*events_topic, interfaces::RosString{json}));
    publish_typed_event(event);
    record(kEventsTopic, json);
  }
}

void LiveService::Impl::publish_typed_event(const BeliefEvent& event) {
  const bool read = is_read(typed_events);
  if (!read && !recording) return;
  const auto message = event_message(event, settings.tracker.assembler.world_frame);
  if (read) check_sent(node->publish(*typed_events, message));
  record_output(kTypedEventsTopic, kTypedEventType, message, event.stamp_ns);
}

void LiveService::Impl::publish_typed_belief(const BeliefSummary& summary) {
  const bool read = is_read(typed_beliefs);
  if (!read && !recording) return;
  const auto message = belief_message(summary, settings.tracker.assembler.world_frame);
  if (read) check_sent(node->publish(*typed_beliefs, message));
  record_output(kTypedBeliefTopic, kTypedBeliefType, message, summary.stamp_ns);
}

void LiveService::Impl::publish(const TrackerStep& step) {
  const std::shared_ptr<const belief::Belief> belief = tracker->belief();
  const BeliefSummary summary = summary_of(*belief);
  const std::string& world = settings.tracker.assembler.world_frame;
  const std::string json = belief::json_text(to_json(summary));
  check_sent(node->publish(beliefs, interfaces::RosString{json}));
  publish_typed_belief(summary);
  const core::TimeNs stamp_ns = summary.stamp_ns;
  publish(detections, kDetectionsTopic, kDetectionsType, detections_of(summary, *belief->scene, world), stamp_ns);
  if (all_poses) publish(*all_poses, kPosesTopic, kPosesType, poses_of(summary, world), stamp_ns);
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
  const interfaces::RosTfMessage frames_of_objects = transforms_of(summary, world);
  if (transforms) check_sent(node->publish(*transforms, frames_of_objects));
  record_output(settings.tracker.topics.tf, kTransformsType, frames_of_objects, stamp_ns);
  record(kBeliefTopic, json);
  publish_events(events.note(summary, *belief->scene, step.news));
  if (collisions)
    planning.tell(summary, *belief->scene, world,
                  {node->matched_readers(*collisions), node->readers_so_far(*collisions)},
                  [&](const interfaces::RosCollisionObject& message) {
                    const core::Status sent = node->publish(*collisions, message);
                    check_sent(sent);
                    return sent.ok();
                  });
  if (overlay && overlay->wants(step.observation))
    overlay->show({belief, summary, step.observation, step.camera_frame});
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
  if (recording) {
    health.recording_at_risk_s = recording->seconds_at_risk();
    health.recording = recording->state();
    health.recording_failure = health.recording.failure;
  }
  health.keeps_learned = !settings.learned_file.empty();
  health.learned_failure = learned_failure;
  health.questions = worker->counts();
  health.unreadable_questions = unreadable_questions;
  health.refused_requests = parameter_services->refused();
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
                         "simulating with Bullet's stepper, which is 2.4 to 7 times slower than in lockstep: " +
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

void LiveService::Impl::note_frames() {
  ServiceHealth health_of_frames;
  health_of_frames.seconds_since_frame = seconds_since_frame();
  const auto event = events.note_frames(is_tracking(health_of_frames), tracker->belief()->stamp_ns,
                                        [this] { return health_text(health()); });
  if (event) publish_events({*event});
}

void LiveService::Impl::publish_diagnostics() {
  const ServiceHealth now = health();
  const core::TimeNs stamp_ns = tracker->uses_simulated_time() ? tracker->simulated_now_ns() : core::wall_now_ns();
  report_changes(now);
  check_sent(node->publish(
      diagnostics, interfaces::RosDiagnosticArray{{interfaces::to_ros_time(stamp_ns), ""},
                                                  {to_diagnostic(now, last_reported, settings.dds.node_name)}}));
  manager.tell_status(health_text(now));
  if (settings.on_health) settings.on_health(health_text(now));
  last_reported = now;
}

}  // namespace prescene::service
