// SPDX-License-Identifier: Apache-2.0
// What was predicted beside what happened: the predictions that were made while a recording was played, each with
// whether the robot then did what the question was about, and with the outcomes that occurred.
#pragma once

#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "prescene/belief/trajectory.h"
#include "prescene/service/belief_summary.h"
#include "prescene/service/recording/recording.h"
#include "prescene/service/tracking/topics.h"
#include "prescene/service/tracking/waiting_controls.h"

namespace prescene::service {

/// Whether one outcome occurred. Of exclusive outcomes, only the one that did is listed, with its group.
struct CameOutcome {
  std::string name;
  std::string group;          ///< Of exclusive outcomes; empty otherwise.
  std::optional<bool> came;   ///< Empty: it could not be judged.
  core::TimeNs since_ns = 0;  ///< If it occurred: from when on it held to the end.
};

/// How a recording ended, by the outcomes of its scene. JSON form on kOutcomeTopic.
struct OutcomeRecord {
  core::TimeNs end_ns = 0;
  std::vector<CameOutcome> outcomes;
};
nlohmann::ordered_json to_json(const OutcomeRecord& record);
core::Result<OutcomeRecord> outcome_record_from_json(const std::string& text);

/// The scene's outcomes as a simulated instance came to them; `start_ns` is the stamp of its time 0.
OutcomeRecord outcomes_of(const belief::Scene& scene, const belief::Trajectory& trajectory, core::TimeNs start_ns);
/// The same by tracked poses alone: what is about contacts can't be judged, nor what is about objects that are lost in
/// the end.
OutcomeRecord outcomes_of(const belief::Scene& scene, const std::map<core::TimeNs, BeliefSummary>& summaries);

/// One prediction beside what happened.
struct Comparison {
  double at = 0.0;       ///< When it was asked, s into the recording.
  std::string question;  ///< "What if carton is let go at 2.30 s?"
  std::string note;      ///< Whether the robot did that, and when.
  bool comparable = false;
  struct Row {
    std::string outcome, group;
    double probability = 0.0, low = 0.0, high = 1.0;
    std::optional<bool> came;
    double since = 0.0;  ///< s into the recording, if it occurred.
  };
  std::vector<Row> rows;
};
/// Whether a row is worth showing: outcomes that were predicted with less than half a per cent and did not occur are
/// left out.
bool is_worth_a_row(const Comparison::Row& row);
/// How it is known what happened.
inline constexpr const char* kCameByTruth = "What happened is taken from the simulated truth.";
inline constexpr const char* kCameByTracking =
    "What happened is taken from the tracked poses, which cannot decide outcomes about contacts.";
/// "92 % (90 to 94 %)"
std::string foreseen_text(const Comparison::Row& row);
/// "yes, from 3.40 s on", "no", "not known"
std::string came_text(const Comparison::Row& row);

/// Collects while a recording is played; anything may come in any order.
///
/// Stamps of frames, beliefs and controls are by the robot's clock, the times of a recording by another: the two are
/// brought together by the depth images, of which both are known. Without one they are taken for the same.
class ForeseenAndCame {
 public:
  /// `depth_topic` is where the recording has its depth images.
  explicit ForeseenAndCame(std::shared_ptr<const belief::Scene> scene, std::string depth_topic = InputTopics().depth)
      : scene_(std::move(scene)), depth_topic_(std::move(depth_topic)) {}

  /// Entries in the order of the recording. Times count from the first. A record of outcomes that is damaged is left
  /// out, and counted.
  void add(const RecordedEntry& entry);
  void add(const BeliefSummary& summary) { summaries_[summary.stamp_ns] = summary; }
  /// What was asked and answered, as JSON, and when (s into the recording).
  void add(double at, const std::string& question, const std::string& answer);

  /// One for each answered prediction, in the order in which they were added.
  std::vector<Comparison> comparisons() const;
  /// Whether what came is the simulated truth, rather than read off the tracked poses.
  bool knows_truth() const { return truth_.has_value(); }
  /// Records of outcomes that could not be read, and why the first could not.
  std::uint64_t damaged_records() const { return damaged_records_; }
  const core::Status& first_damage() const { return first_damage_; }

 private:
  struct Asked {
    double at = 0.0;
    std::string question, answer;
  };
  struct Released {
    std::string object;
    core::TimeNs time_ns = 0;
  };
  struct Frame {
    core::TimeNs received_ns = 0;
    core::TimeNs stamp_ns = 0;
  };
  void add_frame(const interfaces::ReceivedMessage& message);
  static void note_release(core::TimeNs time_ns, const belief::Action& action, std::vector<Released>& releases);
  /// All that is known of now.
  std::vector<Released> releases() const;
  /// The robot's time when the recording was played so far, s.
  core::TimeNs stamp_at(double at) const;
  /// The reverse: s into the recording, of a time of the robot's.
  double seconds(core::TimeNs stamp_ns) const;
  Comparison compared(const Asked& asked, const OutcomeRecord& came) const;
  /// Sets the question's text, the note and whether it can be compared.
  void relate(const Asked& asked, std::uint64_t step, Comparison* comparison) const;
  const ObjectSummary* object_at(const std::string& name, core::TimeNs time_ns) const;

  std::shared_ptr<const belief::Scene> scene_;
  std::optional<core::TimeNs> first_ns_;
  std::map<core::TimeNs, BeliefSummary> summaries_;
  std::string depth_topic_;
  std::vector<Frame> frames_;
  WaitingControls controls_;  // not yet reached by the frames
  std::vector<Released> released_;
  std::uint64_t damaged_records_ = 0;
  core::Status first_damage_;
  std::vector<Asked> asked_;
  std::optional<OutcomeRecord> truth_;
};

}  // namespace prescene::service
