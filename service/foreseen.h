// SPDX-License-Identifier: Apache-2.0
// What was foreseen beside what came to pass: the predictions that were made while a recording was played, each with
// whether the robot then did what the question was about, and with the outcomes as they came.
#pragma once

#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "prescene/belief/trajectory.h"
#include "prescene/service/belief_summary.h"
#include "prescene/service/recording.h"

namespace prescene::service {

/// Whether one outcome came to pass. Of exclusive outcomes, only the one that did is listed, with its group.
struct CameOutcome {
  std::string name;
  std::string group;          ///< Of exclusive outcomes; empty otherwise.
  std::optional<bool> came;   ///< Empty: it could not be judged.
  core::TimeNs since_ns = 0;  ///< Where it came to pass: from when on it held to the end.
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

/// One prediction beside what came.
struct Comparison {
  double at = 0.0;       ///< When it was asked, s into the recording.
  std::string question;  ///< "What if carton is let go at 2.30 s?"
  std::string note;      ///< Whether the robot did that, and when.
  bool comparable = false;
  struct Row {
    std::string outcome, group;
    double probability = 0.0, low = 0.0, high = 1.0;
    std::optional<bool> came;
    double since = 0.0;  ///< s into the recording, where it came.
  };
  std::vector<Row> rows;
};
/// Whether a row says something: outcomes that were foreseen with less than half a per cent and did not come are left
/// out.
bool is_worth_a_row(const Comparison::Row& row);
/// Where it is known from what came.
inline constexpr const char* kCameByTruth = "What came to pass is the simulated truth.";
inline constexpr const char* kCameByTracking =
    "What came to pass is read off the tracked poses; outcomes about contacts can't be judged by these.";
/// "92 % (90 to 94 %)"
std::string foreseen_text(const Comparison::Row& row);
/// "yes, from 3.40 s on", "no", "not known"
std::string came_text(const Comparison::Row& row);

/// Collects while a recording is played; anything may come in any order.
class ForeseenAndCame {
 public:
  explicit ForeseenAndCame(std::shared_ptr<const belief::Scene> scene) : scene_(std::move(scene)) {}

  /// Times count from the first entry.
  void add(const RecordedEntry& entry);
  void add(const BeliefSummary& summary) { summaries_[summary.stamp_ns] = summary; }
  /// What was asked and answered, as JSON, and when (s into the recording).
  void add(double at, const std::string& question, const std::string& answer);

  /// One for each answered prediction, in the order in which they were added.
  std::vector<Comparison> comparisons() const;
  /// Whether what came is the simulated truth, rather than read off the tracked poses.
  bool knows_truth() const { return truth_.has_value(); }

 private:
  struct Asked {
    double at = 0.0;
    std::string question, answer;
  };
  struct Released {
    std::string object;
    core::TimeNs time_ns = 0;
  };
  double seconds(core::TimeNs time_ns) const;
  Comparison compared(const Asked& asked, const OutcomeRecord& came) const;
  /// Sets the question's text, the note and whether it can be compared.
  void relate(const Asked& asked, std::uint64_t step, Comparison* comparison) const;
  const ObjectSummary* object_at(const std::string& name, core::TimeNs time_ns) const;

  std::shared_ptr<const belief::Scene> scene_;
  std::optional<core::TimeNs> first_ns_;
  std::map<core::TimeNs, BeliefSummary> summaries_;
  std::vector<Released> released_;
  std::vector<Asked> asked_;
  std::optional<OutcomeRecord> truth_;
};

}  // namespace prescene::service
