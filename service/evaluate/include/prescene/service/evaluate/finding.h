// SPDX-License-Identifier: Apache-2.0
// How well objects are found in one frame without start poses, on simulated rooms with several supports at different
// heights, where the truth is known.
//
//   PRESCENE_TRY(FindingReport report, evaluate_finding({.first = 1001, .frames = 60}, threads));
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "prescene/core/parallel.h"
#include "prescene/core/progress.h"
#include "prescene/core/status.h"
#include "prescene/filter/particle_filter.h"
#include "prescene/rendering/gpu/likelihood_choice.h"

namespace prescene::service {

struct FindingOptions {
  std::uint64_t first = 1;  ///< Number of the first simulated room, see simulate_supports. Also the filter's seed.
  int frames = 60;
  /// What was learned of the rooms' models (room_models()); null = nothing.
  filter::LearnedModels learned;
  rendering::LikelihoodChoice likelihood;  ///< Who scores poses; nothing but times depend on it.
};

/// One object of one frame.
struct FoundObject {
  std::uint64_t room = 0;
  std::string object;
  std::string stands_on;
  double visible_share = 0.0;
  bool expected = false;    ///< Enough of it is visible (TrueObject::expected).
  bool reported = false;    ///< The belief says that it is there: tracked or doubtful.
  double adds_m = 0.0;      ///< Of the reported pose; infinite when it is not reported.
  double confidence = 0.0;  ///< Of the reported pose.

  bool right() const;  ///< Reported with an ADD-S below 2 cm.
};

/// Counts over a group of objects.
struct FindingRow {
  std::string group;  ///< "all", "all listed", "none listed", "some listed", "half hidden", "on other things", ...
  int looked_for = 0;
  int expected = 0;
  int found = 0;       ///< Of the expected ones, those at the right place.
  int wrong = 0;       ///< Reported elsewhere, of all that were looked for.
  int sure_wrong = 0;  ///< Of these, with a confidence of 0.5 or more.
};

struct FindingReport {
  int frames = 0;
  std::vector<FindingRow> rows;
  std::vector<FoundObject> objects;
  double median_adds_m = 0.0;     ///< Of those at the right place.
  double right_confidence = 0.0;  ///< Mean over those at the right place ...
  double wrong_confidence = 0.0;  ///< ... and over the others that are reported; 0 when there are none.
  double cpu_s = 0.0;             ///< Processor time of a first step, mean ...
  double most_cpu_s = 0.0;        ///< ... and most.
  double cpu_s_of_five = 0.0;     ///< Mean over frames of which the scene names five objects; 0 when there are none.
};

/// Each room is seen once, by a filter of its own with default settings. The same report (times aside) for any number
/// of threads.
core::Result<FindingReport> evaluate_finding(const FindingOptions& options, core::ThreadPool& threads,
                                             const core::ProgressSink& progress = {},
                                             const core::Cancellation* cancellation = nullptr);

nlohmann::ordered_json to_json(const FindingReport& report);

}  // namespace prescene::service
