// SPDX-License-Identifier: Apache-2.0
// Answers to what happened, and to why a pose is believed, that a session recorded, worked out again when it is
// replayed: with the same beliefs, they have the same bits.
//
//   ExplainedAgain again(input, "session.mcap", settings, backends, cancellation);
//   again.add(step.observation, tracker.belief());            // after each step of the replay
//   PRESCENE_RETURN_IF_ERROR(again.add_answer(json, time_ns));  // of each recorded answer, when it comes
//   ... again.compared(), again.different()
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "prescene/belief/why_question.h"
#include "prescene/service/recording/frame_history.h"
#include "prescene/service/recording/replay_input.h"

namespace prescene::service {

class ExplainedAgain {
 public:
  /// All must outlive it. Of a recording that begins in a later file nothing is compared: what was asked counts from
  /// its first.
  ExplainedAgain(const ReplayInput& input, std::filesystem::path path, const TrackerSettings& settings,
                 Backends& backends, const core::Cancellation& cancellation);

  /// Keeps nothing if the recording holds no such answer.
  void add(const belief::Observation& observation, std::shared_ptr<const belief::Belief> belief);
  /// An answer of /prescene/answer and when it was recorded. Others than these, those that were cut short by their
  /// time, and those about more than 300 s before are passed over. Errors of reading the recording, which says
  /// what the robot did; kCancelled.
  core::Status add_answer(const std::string& json, core::TimeNs recorded_ns);

  std::uint64_t compared() const { return compared_; }
  std::uint64_t different() const { return different_; }
  /// Id of the first that differs, and in what; "" = none does.
  const std::string& first_difference() const { return first_difference_; }

 private:
  struct SentControl {
    std::string text;
    core::TimeNs sent_ns = 0, recorded_ns = 0;
  };
  /// Reads on, up to what was received by then.
  core::Status read_controls(core::TimeNs until_ns);
  core::Result<queries::ExplainContext> frames_context();
  core::Result<std::string> explained(const belief::ExplainQuestion& question, PastWindow past,
                                      core::TimeNs recorded_ns);
  core::Result<std::string> reasoned(const belief::WhyQuestion& question, const PastWindow& past);
  /// Counts; kCancelled where working it out again was.
  core::Status compare(const nlohmann::ordered_json& answer, const core::Result<std::string>& again);

  std::filesystem::path path_;
  bool reads_all_parts_;
  const TrackerSettings& settings_;
  Backends& backends_;
  const core::Cancellation& cancellation_;
  std::string scene_text_;
  bool keeps_frames_;
  FrameHistory history_;
  std::unique_ptr<RecordingReader> reader_;  // of the controls; null = none was needed yet
  core::TimeNs controls_until_ns_ = 0;       // received, of the last message that was read
  bool controls_end_ = false;
  std::vector<SentControl> controls_;
  std::unique_ptr<rendering::LikelihoodBatch> likelihood_;
  std::uint64_t compared_ = 0, different_ = 0;
  std::string first_difference_;
};

}  // namespace prescene::service
