// SPDX-License-Identifier: Apache-2.0
// Finds parameters for which a random trial succeeds with a wanted probability, in as few trials as it can, and says
// how sure that is from trials that had no part in finding them.
//
//   SearchOptions options;
//   options.periodic = {false, false, true};             // three parameters, the last of which is an angle
//   SearchResult found = search_parameters(trials, options, stream);
//   if (found.first >= 0) ... found.claims[static_cast<std::size_t>(found.first)].at
//
// Points of one scrambled Sobol net over parameters and scenarios together explore the cube, one trial each; points
// near those that succeeded are drawn as in the cross-entropy method [Rubinstein 1999]; the best of both race with
// doubled numbers of trials in common scenarios [Jamieson & Talwalkar 2016]. A leading point is put to the test with
// fresh scenarios, by an interval that may be looked at at any time (confidence_sequence.h). The k-th test has the
// share 2^-k of the tolerated error, so that a claim of any of them is false with at most that error, however often it
// is tried.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "prescene/core/random.h"

namespace prescene::queries {

/// A point of the unit cube, one number for each parameter.
using UnitPoint = std::vector<double>;

enum class TrialEnd : std::uint8_t { kSucceeds, kFails };

/// Trials with the same scenario (and `fresh`) meet the same chance, whatever the point.
struct Trial {
  std::span<const double> point;
  std::uint32_t scenario = 0;
  bool fresh = false;  ///< Scenarios drawn independently, none of them twice; else those of the search.
};

/// What is searched.
class TrialRunner {
 public:
  virtual ~TrialRunner() = default;
  /// Whether there is anything to try at the point; where not, every trial fails. Pure.
  virtual bool possible(std::span<const double> point) = 0;
  /// Runs trials at possible points; ends.size() == trials.size(). False: it was stopped, and none of them counts.
  virtual bool run(std::span<const Trial> trials, std::span<TrialEnd> ends) = 0;
  /// Asked before each step of the search: whether it should end, as its time is over.
  virtual bool enough() const { return false; }
};

struct SearchOptions {
  std::vector<bool> periodic;       ///< One for each parameter (1 to 16): whether 0 and 1 are the same.
  double wanted = 0.95;             ///< Probability of success, in (0, 1).
  double confidence = 0.95;         ///< Of each claim, in (0, 1).
  int max_trials = 8192;            ///< At possible points; > 0. Of the search: see SearchResult::search_trials.
  std::optional<int> exact_trials;  ///< Instead: ends after the trials in which so many are reached.
  std::uint64_t net_seed = 1;       ///< Of the net whose first coordinates are the parameters, see core::SobolNet.
  /// Also the neighbourhood, the profiles and the map; else it ends with the first claim.
  bool survey = true;
  int profile_values = 16, profile_trials = 4;  ///< Along each parameter, and at each value.
  int map_cells = 16, map_trials = 4;           ///< Along each of two parameters, and in each cell.
};

struct SearchPoint {
  UnitPoint at;
  int successes = 0, trials = 0;
  bool possible = true;
  bool explored = false;       ///< One of the net's points, evenly spread.
  std::uint32_t scenario = 0;  ///< Of its first trial.
  bool first_succeeded = false;
  bool tested = false;  ///< Put to the test.
};

/// What fresh trials say of a point, or of a box in which the point is drawn evenly.
struct SearchClaim {
  UnitPoint at;
  UnitPoint low, high;  ///< The box; empty: just the point. Periodic parameters may go beyond 0 and 1.
  int successes = 0, trials = 0;
  double lower = 0.0, upper = 1.0;  ///< Interval of the probability of success.
  bool holds = false;               ///< lower >= wanted.
  double merit = 0.0;               ///< What the search took its probability for, before the test.
};

/// A point that the search takes for a good one. It was chosen because its trials went well, so that it is probably not
/// quite as good as they say: claims, which rest on fresh trials, are what can be relied on.
struct SearchLeader {
  UnitPoint at;
  int successes = 0, trials = 0;
  double merit = 0.0;  ///< What the search takes its probability for, from its trials and those near it.
};

enum class SearchStop { kDone, kMaxTrials, kExact, kStopped };

inline constexpr std::size_t kMostLeaders = 10;

struct SearchResult {
  std::vector<SearchPoint> points;
  std::vector<SearchClaim> claims;  ///< That hold, of points, in the order in which they were found.
  int first = -1;                   ///< Index of the first claim and
  int best = -1;                    ///< of that with the greatest merit; -1 = none.
  /// Where none holds: the point that did best, with an interval from fresh trials (as far as there was time). Nothing
  /// where no possible point was found.
  std::optional<SearchClaim> nearest;
  std::optional<SearchClaim> box;     ///< The largest box that was found whose claim holds.
  std::vector<SearchLeader> leaders;  ///< At most kMostLeaders, the best first.
  /// About the best point (or the nearest): shares of success along each parameter; -1 where nothing is possible.
  std::vector<std::vector<double>> profiles;
  std::vector<double> fails_alone;  ///< 1 - mean of the profile.
  int map_x = -1, map_y = -1;       ///< Parameters of the map, those that fail most alone.
  std::vector<double> map;          ///< map_cells^2 shares, x fastest; -1 where nothing is possible.
  int search_trials = 0;            ///< All but those of `nearest`.
  int all_trials = 0;
  int attempts = 0;      ///< Points and boxes that were tested.
  int first_trials = 0;  ///< All trials up to the first claim.
  int explored = 0, explored_impossible = 0, explored_successes = 0;
  SearchStop stop = SearchStop::kDone;
};

/// The same arguments give the same result. `on_claim` is called with each claim as it is found, `on_round` with what
/// is known so far (but `points`) after each round of trials until the first claim, and with each claim and each part
/// of the survey; both may be empty.
SearchResult search_parameters(TrialRunner& runner, const SearchOptions& options, const core::RandomStream& stream,
                               const std::function<void(const SearchClaim&)>& on_claim = {},
                               const std::function<void(const SearchResult& so_far)>& on_round = {});

}  // namespace prescene::queries
