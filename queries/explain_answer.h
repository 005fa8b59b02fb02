// SPDX-License-Identifier: Apache-2.0
// From what was found of each hypothesis to the answer.
#pragma once

#include <optional>
#include <vector>

#include "event_paths.h"
#include "prescene/queries/tempered_smc.h"
#include "window_likelihood.h"

namespace prescene::queries {

/// Where an object may end that no frame sees there.
struct UnseenEnd {
  belief::Pose X_WO;
  double weight;  ///< All sum to one.
};

/// A hypothesis with what was found of it.
struct Judged {
  Hypothesis hypothesis;
  double log_bayes = 0.0;  // against nothing about the same object
  double error = 0.0;      // of the evidence of `other`
  std::uint64_t number = 0;
  std::size_t object = 0;
  TemperedResult posterior;      // empty of `other`
  std::vector<ScenePath> paths;  // of its points, where it is probable enough
  std::vector<EventDraw> draws;
  std::vector<belief::Trajectory> runs;
  std::vector<UnseenEnd> unseen_ends;                   // of its object; empty = as its paths end
  std::vector<double> frame_means;                      // of the log ratio in each frame
  std::vector<std::optional<belief::Pose>> other_path;  // of `other`
  /// Where the time ran out before it was searched once: nats that log_bayes may be more by, and that it is not.
  std::optional<double> may_be_more;
  double probability = 0.0, low = 0.0, high = 1.0;
};

struct JudgedEvents {
  const ExplainWindow& window;
  EventPaths& events;
  WindowLikelihood& likelihood;
  const std::vector<double>& times;
  std::vector<Judged>& nothings;           // by candidate; the first is reported
  std::vector<Judged>& judged;             // all others
  const std::vector<std::size_t>& frames;  // that weigh, of the window's
  std::size_t points = 96;                 // of a posterior: its summary is computed from so many
};

/// All but the numbers of evaluations before, and remarks of the search.
ExplainAnswer explain_answer(JudgedEvents& events);
/// Its explanations, text and counts as far as they take no further work.
ExplainAnswer explained_so_far(JudgedEvents& events);

}  // namespace prescene::queries
