// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/service_health.h"

#include "prescene/core/text.h"

namespace prescene::service {
namespace {

using interfaces::RosDiagnosticLevel;

RosDiagnosticLevel level_of(const ServiceHealth& health) {
  if (!health.seconds_since_frame) return RosDiagnosticLevel::kWarn;
  if (!is_tracking(health)) return RosDiagnosticLevel::kError;
  return health.degraded.empty() ? RosDiagnosticLevel::kOk : RosDiagnosticLevel::kWarn;
}

}  // namespace

bool is_tracking(const ServiceHealth& health) {
  return health.seconds_since_frame && *health.seconds_since_frame <= kSilentAfter;
}

std::string health_text(const ServiceHealth& health) {
  if (is_tracking(health)) {
    std::string text = "tracking";
    for (const std::string& word : health.degraded) text += "; " + word;
    return text;
  }
  std::string text =
      health.seconds_since_frame ? "no frame is used any more" : "waiting for frames on " + health.depth_topic;
  if (!health.last_skip.empty()) text += "; the last one was skipped: " + health.last_skip;
  if (!health.last_refusal.empty()) text += "; the last message refused: " + health.last_refusal;
  return text;
}

interfaces::RosDiagnosticStatus to_diagnostic(const ServiceHealth& health, const std::string& hardware_id) {
  interfaces::RosDiagnosticStatus status;
  status.name = "prescene: tracking";
  status.hardware_id = hardware_id;
  status.level = static_cast<std::uint8_t>(level_of(health));
  status.message = health_text(health);
  status.values = {
      {"steps", std::to_string(health.steps)},
      {"skipped frames", std::to_string(health.skipped_frames)},
      {"refused messages", std::to_string(health.refused_messages)},
      {"dropped in the inbox", std::to_string(health.dropped_in_inbox)},
      {"lost on the bus", std::to_string(health.lost_on_bus)},
      {"since the last frame, s", health.seconds_since_frame ? core::fixed_text(*health.seconds_since_frame, 1) : ""},
      {"last step, s", core::rounded_text(health.last_step_seconds)},
      {"last refusal", health.last_refusal},
      {"particles without physics", std::to_string(health.not_simulated)},
      {"last failure of physics", health.physics_failure},
      {"simulators in lockstep", std::to_string(health.steppers.lockstep)},
      {"simulators on Bullet instead", std::to_string(health.steppers.bullet_instead)},
      {"last reason for Bullet", health.steppers.last_reason}};
  return status;
}

}  // namespace prescene::service
