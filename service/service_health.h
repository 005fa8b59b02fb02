// SPDX-License-Identifier: Apache-2.0
// How the live service does, for /diagnostics: whether it tracks, and if not, why not.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "prescene/interfaces/ros_messages/messages.h"
#include "prescene/service/backends.h"

namespace prescene::service {

/// Frames were used before, but none for longer than this, s: the camera or its tf has gone.
inline constexpr double kSilentAfter = 2.0;

struct ServiceHealth {
  std::string depth_topic;
  std::uint64_t steps = 0;
  std::uint64_t skipped_frames = 0;
  std::uint64_t refused_messages = 0;
  std::uint64_t dropped_in_inbox = 0;
  std::uint64_t lost_on_bus = 0;
  std::optional<double> seconds_since_frame;  ///< Since the last frame that was used; empty = none yet.
  double last_step_seconds = 0.0;
  std::uint64_t not_simulated = 0;  ///< Particles that physics could not move and constant velocity did.
  std::string physics_failure;      ///< Why, the last time; "" = it never failed.
  StepperCounts steppers;
  std::vector<std::string> degraded;  ///< What the last step could not do fully.
  std::string last_skip;              ///< Why the last frame since the last step was skipped; "" = none was.
  std::string last_refusal;           ///< Why the last refused message was.
};

/// True while frames come and are used.
bool is_tracking(const ServiceHealth& health);

/// What it does and, while it does not track, why not: "no frame is used: tf does not connect ...".
std::string health_text(const ServiceHealth& health);

/// kWarn before the first frame and for degraded steps, kError when frames stopped.
interfaces::RosDiagnosticStatus to_diagnostic(const ServiceHealth& health, const std::string& hardware_id);

}  // namespace prescene::service
