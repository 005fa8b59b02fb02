// SPDX-License-Identifier: Apache-2.0
// How the live service does, for /diagnostics: whether it tracks, and if not, why not.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "prescene/core/clock.h"
#include "prescene/interfaces/ros_messages/messages.h"
#include "prescene/service/backends.h"
#include "prescene/service/live/query_worker.h"
#include "prescene/service/recording/rolling_recording.h"

namespace prescene::service {

/// Frames were used before, but none for longer than this, s: the camera or its tf has gone.
inline constexpr double kSilentAfter = 2.0;

struct ServiceHealth {
  std::string depth_topic;   ///< Of several cameras those of all.
  std::string cameras;       ///< Of several cameras what was used of each; "" of one.
  std::string nothing_came;  ///< As nothing_came_text(), once none has for some seconds; "" = images come, or may yet.
  std::uint64_t steps = 0;
  std::uint64_t skipped_frames = 0;
  std::uint64_t refused_messages = 0;
  /// Messages that waited for the tracker and were dropped because too many did, by topic.
  std::map<std::string, std::uint64_t> dropped_in_inbox;
  /// Of whose messages the newest is all that counts: dropping others is no loss.
  std::vector<std::string> image_topics;
  std::uint64_t lost_on_bus = 0;  ///< Samples that reached this process and were never read.
  QueryCounts questions;
  std::uint64_t unreadable_questions = 0;  ///< Messages on the topic of questions that hold no text.
  std::uint64_t refused_requests = 0;      ///< To the services of parameters: they made no sense, and got no reply.
  std::uint64_t unsent = 0;          ///< Messages of ours that the middleware did not take: a reader does not keep up.
  std::uint64_t failures = 0;        ///< Messages and frames that ended in an exception and were left out.
  std::uint64_t unlogged = 0;        ///< Lines that were left out of the log because too many came.
  std::uint64_t tf_forgotten = 0;    ///< Transforms that were forgotten early for want of room.
  std::uint64_t tf_late = 0;         ///< Transforms that came when they were older than what is kept.
  std::size_t waiting_controls = 0;  ///< Actions of controls that wait for a frame.
  std::uint64_t dropped_controls = 0;  ///< Those that were dropped, as their stamps are by another clock.
  std::uint64_t idle_controls = 0;     ///< Actions of controls that changed nothing, as in idle_controls().
  std::string last_idle_control;       ///< What the last of them was, and why.
  int other_services = 0;              ///< Which publish beliefs in the same DDS domain.
  bool is_recording = false;
  RollingState recording;            ///< Where one was asked for.
  double recording_at_risk_s = 0.0;  ///< As RecordingWriter::seconds_at_risk().
  std::string recording_failure;     ///< Why nothing is recorded now; "" = it is, or none was asked for.
  bool keeps_learned = false;
  std::string learned_failure;  ///< Why what was learned could not be written the last time; "" = it could.
  /// Since the last frame that was used, by simulated time where there is one; empty = none yet.
  std::optional<double> seconds_since_frame;
  std::string clock_topic;                   ///< Of simulated time; "" = time is not simulated.
  double simulated_now_s = 0.0;              ///< What it says.
  std::optional<double> seconds_since_tick;  ///< Since it said another time, by a real clock; empty = never.
  double last_step_seconds = 0.0;
  std::uint64_t not_simulated = 0;  ///< Particles that physics could not move and constant velocity did.
  std::string physics_failure;      ///< Why, the last time; "" = it never failed.
  StepperCounts steppers;
  std::string lens;                   ///< What is done about the distortion of the camera's lens; "" = not known yet.
  std::vector<std::string> degraded;  ///< What the last step could not do fully.
  std::string last_skip;              ///< Why the last frame since the last step was skipped; "" = none was.
  std::string last_refusal;           ///< Why the last refused message was.
  std::string last_failure;           ///< What the last exception outside of questions said, and when, as of
  core::TimeNs last_failure_ns = 0;   ///< core::steady_now_ns().
};

/// True while frames come and are used, and while simulated time stands still after it.
bool is_tracking(const ServiceHealth& health);

/// What `other_services` (at least one) in the same DDS domain mean.
std::string others_text(int other_services);

/// What it does and, while it does not track, why not: "no frame is used: tf does not connect ...".
std::string health_text(const ServiceHealth& health);

/// kWarn before the first frame, for degraded steps, beside other services, while simulated time stands still, while
/// the disk does not keep up with the recording, and when something failed, was lost or had no effect since `before`,
/// the health of the last report (or none); kError when frames stopped, or the recording or keeping what was learned
/// failed. The values are those since the start.
interfaces::RosDiagnosticStatus to_diagnostic(const ServiceHealth& health, const ServiceHealth& before,
                                              const std::string& hardware_id);

}  // namespace prescene::service
