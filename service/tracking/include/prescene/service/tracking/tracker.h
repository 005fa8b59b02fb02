// SPDX-License-Identifier: Apache-2.0
// One scene, tracked by one camera or several: messages go in, beliefs come out. The live service and the replay of a
// recording both drive it; it reads no clock and owns no thread, so that both come to the same bits.
//
//   PRESCENE_TRY(auto tracker, Tracker::create(scene, settings, seed, backends));
//   PRESCENE_RETURN_IF_ERROR(tracker->take_in(message, index));
//   while (auto step = tracker->step(now_ns)) ... *step, *tracker->belief()
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "prescene/belief/belief.h"
#include "prescene/filter/particle_filter.h"
#include "prescene/interfaces/scene_files/learned_file.h"
#include "prescene/rendering/sensor/likelihood_batch.h"
#include "prescene/service/backends.h"
#include "prescene/service/tracking/camera_frames.h"
#include "prescene/service/tracking/step_record.h"
#include "prescene/service/tracking/tracker_settings.h"
#include "prescene/service/tracking/tracker_snapshot.h"
#include "prescene/service/tracking/waiting_controls.h"

namespace prescene::service {

/// What happened in a step besides what the belief after it says.
struct StepNews {
  bool clock_went_back = false;  ///< So that the belief began anew, ...
  bool restarted = false;        ///< ... or as a control asked.
  int inferred_releases = 0;     ///< As in filter::StepCounters.
  std::vector<SilentCamera> silent = {};
};

/// One belief step as it happened.
struct TrackerStep {
  StepRecord record;
  filter::StepCounters counters;
  std::string physics_failure;                       ///< As in filter::StepResult.
  IdleControls idle_controls;                        ///< Also reported, in words, in record.degraded.
  filter::HashTrace trace;                           ///< Empty unless Tracker::trace_stages() asks for it.
  std::vector<filter::SupportMeasurement> supports;  ///< As in filter::StepResult.
  belief::Observation observation;
  std::string camera_frame;  ///< As of AssembledFrame.
  StepNews news;
};

/// Not thread-safe but for belief().
class Tracker {
 public:
  /// `backends` must outlive the tracker. Errors of the scene, of the learned file in the settings, of the backends.
  static core::Result<std::unique_ptr<Tracker>> create(std::shared_ptr<const belief::Scene> scene,
                                                       const TrackerSettings& settings, std::uint64_t seed,
                                                       Backends& backends);

  /// As ParticleFilter::prepare(), of the tracker's scene: what listens to a camera does so before the first frame.
  void prepare() { filter_.prepare(*scene_); }

  /// Takes in one message of the robot, or one on kSettingsTopic, whose settings hold from the next step on; topics
  /// that nobody listens to are ignored. Numbers ascend. A message that says something impossible is refused, and named
  /// with its topic; nothing else is lost by it.
  core::Status take_in(const interfaces::ReceivedMessage& message, MessageIndex index, DecodedImages images = {});
  /// As CameraFrames::decode(); from any thread.
  DecodedImages decode(const interfaces::ReceivedMessage& message) const { return frames_.decode(message); }
  /// One belief step with the newest frame that is complete at `now_ns`, or in simulated time now; empty if there is
  /// none. Where the sender's
  /// clock went back (a recording is played again) the belief starts anew. Controls wait for the first step that they
  /// can act in, which is the second of a belief. Where it ends in an exception nothing is changed but that the frame
  /// is gone.
  std::optional<TrackerStep> step(core::TimeNs now_ns);
  /// The step that a recording tells of, once the messages before it were taken in; empty where its frame is not there.
  std::optional<TrackerStep> repeat(const StepRecord& recorded);
  /// When step() should be tried again although nothing came in. Simulated time goes on by messages only.
  std::optional<core::TimeNs> next_deadline() const {
    return uses_simulated_time() ? std::nullopt : frames_.next_deadline();
  }
  /// Whether the settings name a clock topic. What frames wait for each other, and the time of controls without a
  /// stamp, is counted by it then; it stands still until it comes, as in ROS.
  bool uses_simulated_time() const { return !settings_.topics.clock.empty(); }
  /// What the newest message on it said; 0 = none has come.
  core::TimeNs simulated_now_ns() const { return simulated_now_ns_; }

  /// All that later steps depend on, but for what ParticleFilter measures of cameras now and then, and messages: those
  /// of tf, joint states, camera infos and settings, and the images from oldest_needed() on.
  TrackerSnapshot snapshot() const { return {belief(), controls_, taken_}; }
  std::optional<MessageIndex> oldest_needed() const { return frames_.oldest_needed(); }
  /// Goes on from there; to be called when these messages were taken in.
  void resume(const TrackerSnapshot& snapshot);
  /// As ParticleFilter's; to be called where a snapshot is made, so that whoever resumes comes to the same bits.
  void measure_cameras_anew() { filter_.measure_cameras_anew(); }
  /// The scene that snapshots are of: as it was given, with what the learned file says of models.
  const std::shared_ptr<const belief::Scene>& scene() const { return scene_; }

  /// As ParticleFilter::trace_stages().
  void trace_stages(bool traces) { filter_.trace_stages(traces); }
  /// As ParticleFilter::report_supports().
  void report_supports(bool reports) { filter_.report_supports(reports); }

  /// Frames that were not used, since the start, and why the newest since the last step was not ("" = none was).
  std::uint64_t skipped_count() const { return frames_.skipped_count(); }
  std::string last_skip() const { return frames_.last_skip(); }
  /// Transforms that tf's buffer forgot early for want of room, since the start.
  std::uint64_t tf_forgotten() const { return frames_.tf_forgotten(); }
  std::uint64_t tf_late() const { return frames_.tf_late(); }
  /// What is done about the lens, as FrameAssembler::lens_text().
  std::string lens_text() const { return frames_.lens_text(); }
  /// As CameraFrames::counts_text().
  std::string cameras_text() const { return frames_.counts_text(); }
  /// Actions of controls that wait for a frame, and those that were dropped since the start, as in WaitingControls.
  std::size_t waiting_controls() const { return controls_.count(); }
  std::uint64_t dropped_controls() const { return controls_.dropped(); }

  /// The newest belief; a snapshot that never changes. Safe from any thread.
  std::shared_ptr<const belief::Belief> belief() const;
  const TrackerSettings& settings() const { return settings_; }
  /// The learned file of the settings, with what the newest belief knows of the scene's objects put in.
  interfaces::LearnedFile learned() const { return with_learned(learned_, *scene_, belief()->objects); }

 private:
  Tracker(std::shared_ptr<const belief::Scene> scene, const TrackerSettings& settings, interfaces::LearnedFile learned,
          std::vector<belief::PhysicalBelief> physics, std::uint64_t seed, Backends& backends,
          std::unique_ptr<rendering::Renderer> renderer, std::unique_ptr<rendering::LikelihoodBatch> likelihood);
  core::TimeNs time_at(core::TimeNs now_ns) const { return uses_simulated_time() ? simulated_now_ns_ : now_ns; }
  TrackerStep step_with(AssembledFrame frame, core::TimeNs now_ns);
  /// The belief before any frame.
  belief::Belief start(std::uint64_t seed) const;

  TrackerSettings settings_;
  std::unique_ptr<rendering::Renderer> renderer_;
  std::unique_ptr<rendering::LikelihoodBatch> likelihood_;
  filter::ParticleFilter filter_;
  CameraFrames frames_;
  core::TimeNs simulated_now_ns_ = 0;
  MessageIndex last_index_ = 0;
  WaitingControls controls_;
  std::vector<TrackerSnapshot::Taken> taken_;   // the newest of each camera
  std::shared_ptr<const belief::Scene> scene_;  // as given, with the values of learned models
  interfaces::LearnedFile learned_;
  std::vector<belief::PhysicalBelief> physics_;  // at the start, of the scene's objects
  mutable std::mutex mutex_;                     // guards belief_
  std::shared_ptr<const belief::Belief> belief_;
};

}  // namespace prescene::service
