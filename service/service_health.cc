// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/service_health.h"

#include "prescene/core/text.h"

namespace prescene::service {
namespace {

using interfaces::RosDiagnosticLevel;

RosDiagnosticLevel level_of(const ServiceHealth& health) {
  if (!health.recording_failure.empty()) return RosDiagnosticLevel::kError;
  if (!health.seconds_since_frame) return RosDiagnosticLevel::kWarn;
  if (!is_tracking(health)) return RosDiagnosticLevel::kError;
  if (health.failures > 0 || health.questions.failed > 0) return RosDiagnosticLevel::kWarn;
  return health.degraded.empty() ? RosDiagnosticLevel::kOk : RosDiagnosticLevel::kWarn;
}

std::uint64_t sum_of(const std::map<std::string, std::uint64_t>& counts) {
  std::uint64_t sum = 0;
  for (const auto& [topic, count] : counts) sum += count;
  return sum;
}

/// "/camera/depth 3, /tf 12".
std::string counts_text(const std::map<std::string, std::uint64_t>& counts) {
  std::string text;
  for (const auto& [topic, count] : counts) text += (text.empty() ? "" : ", ") + topic + " " + std::to_string(count);
  return text;
}

std::string recording_text(const ServiceHealth& health) {
  if (!health.recording_failure.empty()) return "failed: " + health.recording_failure;
  return health.is_recording ? "on" : "off";
}

}  // namespace

bool is_tracking(const ServiceHealth& health) {
  return health.seconds_since_frame && *health.seconds_since_frame <= kSilentAfter;
}

std::string health_text(const ServiceHealth& health) {
  const std::string recording =
      health.recording_failure.empty() ? "" : "; the recording failed: " + health.recording_failure;
  if (is_tracking(health)) {
    std::string text = "tracking";
    for (const std::string& word : health.degraded) text += "; " + word;
    return text + recording;
  }
  std::string text =
      health.seconds_since_frame ? "no frame is used any more" : "waiting for frames on " + health.depth_topic;
  if (!health.last_skip.empty()) text += "; the last one was skipped: " + health.last_skip;
  if (!health.last_refusal.empty()) text += "; the last message refused: " + health.last_refusal;
  return text + recording;
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
      {"dropped in the inbox", std::to_string(sum_of(health.dropped_in_inbox))},
      {"dropped by topic", counts_text(health.dropped_in_inbox)},
      {"lost on the bus", std::to_string(health.lost_on_bus)},
      {"not sent", std::to_string(health.unsent)},
      {"lines not logged", std::to_string(health.unlogged)},
      {"transforms forgotten early", std::to_string(health.tf_forgotten)},
      {"recording", recording_text(health)},
      {"since the last frame, s", health.seconds_since_frame ? core::fixed_text(*health.seconds_since_frame, 1) : ""},
      {"last step, s", core::rounded_text(health.last_step_seconds)},
      {"last refusal", health.last_refusal},
      {"questions answered", std::to_string(health.questions.answered)},
      {"questions refused", std::to_string(health.questions.refused)},
      {"questions without an answer", std::to_string(health.questions.unanswered + health.unreadable_questions)},
      {"failures", std::to_string(health.failures + health.questions.failed)},
      {"last failure", health.last_failure},
      {"particles without physics", std::to_string(health.not_simulated)},
      {"last failure of physics", health.physics_failure},
      {"simulators in lockstep", std::to_string(health.steppers.lockstep)},
      {"simulators on Bullet instead", std::to_string(health.steppers.bullet_instead)},
      {"last reason for Bullet", health.steppers.last_reason}};
  return status;
}

}  // namespace prescene::service
