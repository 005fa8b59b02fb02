// SPDX-License-Identifier: Apache-2.0
// Posterior and evidence of a likelihood under a standard normal prior, by sequential Monte Carlo along a path of
// tempered distributions [Neal 2001; Del Moral et al. 2006].
//
// The path leads from a proposal q to the posterior: q^(1-b) (N L)^b for b from 0 to 1, N the standard normal density.
// Steps of b keep the effective sample size; after each, points are resampled and moved by Metropolis-Hastings.
// Independent runs go side by side, so that one call of the likelihood serves all.
#pragma once

#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "prescene/core/progress.h"
#include "prescene/core/random.h"

namespace prescene::queries {

using LatentPoint = std::vector<double>;

struct TemperedTarget {
  int dimensions = 0;  ///< Of a point.
  int moved = 0;  ///< The first so many are proposed by `mean` and moved by random walks; the others are nuisances.
  /// A guess of where the posterior is in the first `moved` coordinates, with deviations; empty = none. Half of the
  /// first points are drawn there, the rest from the prior.
  std::vector<double> guess_mean, guess_deviation;
  /// Where runs before found it in these: the mean, and Cholesky's factor of the covariance (lower triangle of moved x
  /// moved, row by row); empty = none. Half of the first points are then drawn there, the others as above.
  std::vector<double> found_mean, found_factor;
  /// log L of each point, -inf = impossible.
  std::function<void(std::span<const LatentPoint> points, std::span<double> log_likelihoods)> evaluate;
};

struct TemperedOptions {
  int runs = 4;                  ///< Independent ones: their scatter is the error of the evidence.
  int points = 24;               ///< Of each, ...
  int first_points = 4;          ///< ... and so many times as many at first, so that few posteriors are missed.
  double least_effective = 0.5;  ///< Share of the points that a step of b leaves as effective sample size.
  int most_steps = 24;           ///< Of b; the last goes to 1 whatever it costs.
  int last_moves = 2;            ///< Moves at b = 1; one at each b before.
  int first_run = 0;             ///< Their numbers: results of other numbers are independent, and merge().
  /// A run ends when its log evidence can't reach this any more, because no point is likelier than `most_likely`.
  double give_up_below = -std::numeric_limits<double>::infinity();
  double most_likely = std::numeric_limits<double>::infinity();  ///< Upper bound of log L.
  /// Asked between moves; from when it says so, runs end with one step of b, whatever it costs. Empty = never.
  std::function<bool()> out_of_time;
};

struct TemperedPoint {
  LatentPoint z;
  double log_likelihood = 0.0;
  double weight = 0.0;  ///< All sum to one.
};

struct TemperedResult {
  std::vector<TemperedPoint> points;
  /// Of each run. An upper bound where it gave up. Where it is unfinished, the rest of b was one step: without bias,
  /// too, but mostly too small.
  std::vector<double> log_evidence;
  double mean_log_evidence = 0.0;  ///< log of the mean of the runs' evidence.
  double error = 0.0;              ///< Standard error of that.
  int evaluations = 0;             ///< Of the likelihood.
  bool cut_short = false;          ///< The last step of b was larger than the effective sample size allows.
  bool gave_up = false;            ///< A run did.
  bool unfinished = false;         ///< The time ran out before all runs were at b = 1.
  /// Of what is unfinished, an upper bound of the log evidence: of the rest of b, by TemperedOptions::most_likely.
  double at_most = std::numeric_limits<double>::infinity();
};

/// Sets where `found`, of the same target, has the posterior, somewhat wider. Runs that are proposed from there need
/// fewer steps and scatter less. The evidence of each is still without bias, as it is for any proposal that does not
/// depend on that run [adaptive importance sampling, Cappé et al. 2004]. Nothing without coordinates that are moved.
void propose_from(const TemperedResult& found, TemperedTarget& target);
/// The same from the posterior of another target that has the first `shared` coordinates in common; in the others, the
/// guess, or the prior.
void propose_from(const TemperedResult& found, std::size_t shared, TemperedTarget& target);

/// Of both results' runs, which must be of the same target and options but for `first_run`.
TemperedResult merge(const TemperedResult& a, const TemperedResult& b);

/// `stream` is used at (step of b, run and point).
TemperedResult tempered_posterior(const TemperedTarget& target, const TemperedOptions& options,
                                  const core::RandomStream& stream, const core::Cancellation* cancellation = nullptr);

}  // namespace prescene::queries
