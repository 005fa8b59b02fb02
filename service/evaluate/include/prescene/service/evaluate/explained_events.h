// SPDX-License-Identifier: Apache-2.0
// How often explanations name the right event, how well their probabilities are calibrated, and how far their times and
// directions are off: on simulated episodes, played by Bullet's stepper with steps of 1 ms, a friction that the tracker
// does not know and a camera that is noisier than the tracker's model of one.
#pragma once

#include <array>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "prescene/core/parallel.h"
#include "prescene/core/progress.h"
#include "prescene/core/status.h"
#include "prescene/queries/explain.h"
#include "prescene/service/evaluate/event_episodes.h"

namespace prescene::service {

struct ExplainedEventsOptions {
  int episodes = 330;                 ///< The kinds in turn.
  std::vector<std::string> kinds;     ///< Only these; empty = all.
  double rate = 15.0;                 ///< Simulated frames a second.
  queries::ExplainQuery query;        ///< Its seed is that of the episode.
  std::optional<double> max_seconds;  ///< For each, as ExplainOptions.
};

/// One of the explanations of an episode.
struct RankedEvent {
  std::string event;  ///< With its object: "pushed thing_1".
  double probability = 0.0, log_bayes_factor = 0.0;
};

/// One episode and what was said of it.
struct EpisodeResult {
  std::string kind;
  std::uint64_t seed = 0;
  belief::EventKind truth = belief::EventKind::kNothing;
  std::string failure;               ///< Why there is no explanation; "" = there is one.
  std::string first;                 ///< The most probable event with its object: "pushed thing_1".
  double probability = 0.0;          ///< Of that.
  double low = 0.0, high = 0.0;      ///< Its stated interval.
  std::vector<RankedEvent> ranking;  ///< All explanations that are probable at all, the first one first.
  double of_truth = 0.0;             ///< Of the true event of the true object.
  bool right = false;                ///< The first is the true event of the true object; ...
  bool nearly_right = false;         ///< ... or it is a push for a blow, or the other way round.
  double time_error = -1.0;          ///< s; negative = none (not right, or no event).
  double direction_error = -1.0;     ///< rad, of pushes and blows.
  double place_error = -1.0;         ///< m, of where the object is said to be in the end; negative = it is not there.
  double place_radius = 0.0;         ///< m, the stated 90 % radius.
  bool place_within = false;         ///< The error is within that.
  bool hidden = false;               ///< It is truly out of sight there.
  bool cut_short = false;            ///< The time ran out.
  double seconds = 0.0;              ///< CPU time of tracking and explanation ...
  double explaining = 0.0;           ///< ... and of the explanation alone.
};

struct ExplainedEventsReport {
  std::vector<EpisodeResult> episodes;
};

/// Errors of no episode: those are in its `failure`. kInvalidInput for an unknown kind, kCancelled.
core::Result<ExplainedEventsReport> evaluate_explained_events(const ExplainedEventsOptions& options, std::uint64_t seed,
                                                              core::ThreadPool& threads,
                                                              const core::ProgressSink& progress,
                                                              const core::Cancellation* cancellation = nullptr);

/// One episode; the recording is written to `folder` and removed.
EpisodeResult explain_episode(const EventEpisode& episode, std::uint64_t seed, const ExplainedEventsOptions& options,
                              const std::string& folder, const core::Cancellation& cancellation);

nlohmann::ordered_json to_json(const ExplainedEventsReport& report);
/// A row for each kind and one for all, and below the figures of calibration.
std::vector<std::vector<std::string>> table_of(const ExplainedEventsReport& report);
/// Mean difference of stated probability and share of right ones over ten bins, weighted by their sizes: of the first
/// explanations.
double expected_calibration_error(const ExplainedEventsReport& report);

}  // namespace prescene::service
