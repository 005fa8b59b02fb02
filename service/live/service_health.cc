// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/live/service_health.h"

#include <algorithm>
#include <cmath>

#include "prescene/core/text.h"

namespace prescene::service {
namespace {

using interfaces::RosDiagnosticLevel;

/// What failed or was lost since the start; only ever grows.
std::uint64_t losses_of(const ServiceHealth& health) {
  std::uint64_t sum = health.lost_on_bus + health.unsent + health.failures + health.tf_forgotten + health.tf_late +
                      health.dropped_controls + health.idle_controls + health.unreadable_questions +
                      health.refused_requests + health.questions.unanswered + health.questions.failed +
                      health.recording.interruptions + health.recording.lost_messages + health.recording.not_repeated +
                      health.recording.unfinished;
  for (const auto& [topic, count] : health.dropped_in_inbox) {
    const auto& images = health.image_topics;
    if (std::find(images.begin(), images.end(), topic) == images.end()) sum += count;
  }
  return sum;
}

bool is_recording_late(const ServiceHealth& health) { return health.recording_at_risk_s > kTooLongAtRisk; }

/// Simulated time is paused, or nobody tells it.
bool stands_still(const ServiceHealth& health) {
  return !health.clock_topic.empty() && health.seconds_since_tick.value_or(HUGE_VAL) > kSilentAfter;
}

RosDiagnosticLevel level_of(const ServiceHealth& health, const ServiceHealth& before) {
  if (!health.recording_failure.empty() || !health.learned_failure.empty()) return RosDiagnosticLevel::kError;
  if (!health.seconds_since_frame) return RosDiagnosticLevel::kWarn;
  if (!is_tracking(health)) return RosDiagnosticLevel::kError;
  if (losses_of(health) > losses_of(before)) return RosDiagnosticLevel::kWarn;
  const bool is_well =
      health.degraded.empty() && health.other_services == 0 && !is_recording_late(health) && !stands_still(health);
  return is_well ? RosDiagnosticLevel::kOk : RosDiagnosticLevel::kWarn;
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
  if (!health.is_recording) return "off";
  if (is_recording_late(health))
    return "on, but the disk is slow: what came in the last " + core::fixed_text(health.recording_at_risk_s, 1) +
           " s is lost if the power fails";
  return health.recording.not_removed.empty() ? "on" : "on, but " + health.recording.not_removed;
}

std::string learned_text(const ServiceHealth& health) {
  if (!health.learned_failure.empty()) return "failed: " + health.learned_failure;
  return health.keeps_learned ? "yes" : "no";
}

std::string clock_text(const ServiceHealth& health) {
  if (health.clock_topic.empty()) return "";
  return health.seconds_since_tick ? core::fixed_text(health.simulated_now_s, 3) : "has not come";
}

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : "; ") + word;
  return text;
}

// Every member is bound to a name, so that one which is added does not compile until it is told of here.
std::vector<interfaces::RosKeyValue> values_of(const ServiceHealth& health) {
  const auto& [depth_topic, cameras, nothing_came, steps, skipped_frames, refused_messages, dropped_in_inbox,
               image_topics, lost_on_bus, questions, unreadable_questions, refused_requests, unsent, failures, unlogged,
               tf_forgotten, tf_late, waiting_controls, dropped_controls, idle_controls, last_idle_control,
               other_services, is_recording, recording, recording_at_risk_s, recording_failure, keeps_learned,
               learned_failure, seconds_since_frame, clock_topic, simulated_now_s, seconds_since_tick,
               last_step_seconds, not_simulated, physics_failure, steppers, lens, degraded, last_skip, last_refusal,
               last_failure, last_failure_ns] = health;
  const auto& [answered, refused, unanswered, repeated, cancels, failed, question_failure, question_failure_ns] =
      questions;
  const auto& [lockstep, bullet_instead, last_reason] = steppers;
  const auto& [file, files, removed_files, interruptions, tries, lost_messages, failure, first_failure, without_belief,
               not_removed, not_repeated, unfinished, last_unfinished] = recording;
  static_cast<void>(image_topics);         // says what of dropped_in_inbox is a loss
  static_cast<void>(nothing_came);         // is in the text
  static_cast<void>(is_recording);         // told, like
  static_cast<void>(recording_at_risk_s);  // both of these,
  static_cast<void>(recording_failure);    // by recording_text(),
  static_cast<void>(failure);              // as
  static_cast<void>(not_removed);          // these
  static_cast<void>(keeps_learned);        // and by
  static_cast<void>(learned_failure);      // learned_text(),
  static_cast<void>(clock_topic);          // and
  static_cast<void>(simulated_now_s);      // these by
  static_cast<void>(seconds_since_tick);   // clock_text()
  const bool question_is_newer = last_failure.empty() || question_failure_ns > last_failure_ns;
  return {{"steps", std::to_string(steps)},
          {"depth topic", depth_topic},
          {"cameras", cameras},
          {"skipped frames", std::to_string(skipped_frames)},
          {"last skip", last_skip},
          {"refused messages", std::to_string(refused_messages)},
          {"last refusal", last_refusal},
          {"dropped in the inbox", std::to_string(sum_of(dropped_in_inbox))},
          {"dropped by topic", counts_text(dropped_in_inbox)},
          {"lost on the bus", std::to_string(lost_on_bus)},
          {"not sent", std::to_string(unsent)},
          {"lines not logged", std::to_string(unlogged)},
          {"transforms forgotten early", std::to_string(tf_forgotten)},
          {"transforms too late", std::to_string(tf_late)},
          {"controls waiting", std::to_string(waiting_controls)},
          {"controls dropped", std::to_string(dropped_controls)},
          {"controls without effect", std::to_string(idle_controls)},
          {"last control without effect", last_idle_control},
          {"other services in the domain", std::to_string(other_services)},
          {"recording", recording_text(health)},
          {"recorded file", is_recording ? file.string() : ""},
          {"recorded files", std::to_string(is_recording ? files : 0)},
          {"recorded files removed", std::to_string(removed_files)},
          {"recording without a belief", without_belief},
          {"recording interrupted", std::to_string(interruptions)},
          {"first interruption", first_failure},
          {"tries to go on recording", std::to_string(tries)},
          {"messages not recorded", std::to_string(lost_messages)},
          {"messages not repeated", std::to_string(not_repeated)},
          {"recording jobs unfinished", std::to_string(unfinished)},
          {"last unfinished recording job", last_unfinished},
          {"keeps what it learns", learned_text(health)},
          {"simulated time, s", clock_text(health)},
          {"since the last frame, s", seconds_since_frame ? core::fixed_text(*seconds_since_frame, 1) : ""},
          {"last step, s", core::rounded_text(last_step_seconds)},
          {"lens", lens},
          {"degraded", joined(degraded)},
          {"questions answered", std::to_string(answered)},
          {"questions refused", std::to_string(refused)},
          {"questions without an answer", std::to_string(unanswered + unreadable_questions)},
          {"questions repeated", std::to_string(repeated)},
          {"requests for parameters refused", std::to_string(refused_requests)},
          {"requests to cancel", std::to_string(cancels)},
          {"failures", std::to_string(failures + failed)},
          {"last failure", question_is_newer && !question_failure.empty() ? question_failure : last_failure},
          {"particles without physics", std::to_string(not_simulated)},
          {"last failure of physics", physics_failure},
          {"simulators in lockstep", std::to_string(lockstep)},
          {"simulators on Bullet instead", std::to_string(bullet_instead)},
          {"last reason for Bullet", last_reason}};
}

}  // namespace

std::string others_text(int other_services) {
  return (other_services == 1 ? "another service publishes"
                              : std::to_string(other_services) + " other services publish") +
         std::string(
             " in this DDS domain: poses, beliefs and answers of all of them come on the same topics; give each a "
             "--domain of its own");
}

bool is_tracking(const ServiceHealth& health) {
  return health.seconds_since_frame && *health.seconds_since_frame <= kSilentAfter;
}

std::string health_text(const ServiceHealth& health) {
  std::string end = health.recording_failure.empty() ? "" : "; the recording failed: " + health.recording_failure;
  if (!health.learned_failure.empty()) end += "; what was learned could not be kept: " + health.learned_failure;
  if (health.other_services > 0) end += "; " + others_text(health.other_services);
  if (stands_still(health))
    end += health.seconds_since_tick ? "; simulated time stands still: nothing new on " + health.clock_topic + " for " +
                                           core::fixed_text(*health.seconds_since_tick, 0) + " s"
                                     : "; no simulated time has come on " + health.clock_topic +
                                           ": start the simulator, or leave --use-sim-time out";
  if (is_tracking(health)) {
    std::string text = "tracking";
    for (const std::string& word : health.degraded) text += "; " + word;
    return text + end;
  }
  std::string text =
      health.seconds_since_frame ? "no frame is used any more" : "waiting for frames on " + health.depth_topic;
  if (!health.nothing_came.empty()) text = health.nothing_came;
  if (!health.last_skip.empty()) text += "; the last one was skipped: " + health.last_skip;
  if (!health.last_refusal.empty()) text += "; the last message refused: " + health.last_refusal;
  return text + end;
}

interfaces::RosDiagnosticStatus to_diagnostic(const ServiceHealth& health, const ServiceHealth& before,
                                              const std::string& hardware_id) {
  interfaces::RosDiagnosticStatus status;
  status.name = "prescene: tracking";
  status.hardware_id = hardware_id;
  status.level = static_cast<std::uint8_t>(level_of(health, before));
  status.message = health_text(health);
  status.values = values_of(health);
  return status;
}

}  // namespace prescene::service
