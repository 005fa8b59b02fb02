// SPDX-License-Identifier: Apache-2.0
// What simulated runs of an episode say about the draws that they were simulated with.
//
// A run is compared with what was seen by a kernel, exp(-sharpness / 2 * mean square of its errors * independent
// samples), and the likelihood of a draw is the mean of its runs' kernels. After impacts, runs from nearly the same
// start end far apart. Few runs then come near to what was seen, and which draws these belong to is chance: with the
// kernel of the sensor's noise alone (sharpness 1), a draw would win by luck. How sharp the kernel may be is therefore
// found out with the runs themselves. One run of each draw takes the part of what was seen, with noise added; the runs
// of the other draws say which draw it came from; the sharpness that does best at this, by the logarithmic score, is
// taken. Where no run identifies another's draw this is 0, and nothing is learned. (Approximate Bayesian computation,
// [Sisson et al. 2018]; the bandwidth is chosen by cross-validation.)
#pragma once

#include <limits>
#include <span>
#include <vector>

#include "prescene/belief/physical_belief.h"
#include "prescene/core/random.h"

namespace prescene::filter {

/// Coordinates of an error of a pose.
inline constexpr int kErrorSize = 6;
/// Stands for the errors of a run that is no prediction.
inline constexpr double kNoPrediction = -std::numeric_limits<double>::infinity();

/// Runs of an episode, run r of draw r % draws.
struct EpisodeRuns {
  /// kErrorSize * samples numbers a run: by how many of its standard deviations a simulated pose is off what was seen,
  /// in each direction. kNoPrediction throughout = the run is no prediction.
  std::span<const double> errors;
  int samples = 0;            ///< Of a run.
  double independent = 0.0;   ///< How many of the samples count.
  double most_squares = 0.0;  ///< A sample's squares count for no more.
  /// Correlation of the noise of neighbouring samples, in [0, 1).
  double correlation = 0.0;
};

struct EpisodeEvidence {
  /// Of each draw; all 0 where nothing is learned.
  std::vector<double> log_likelihoods;
  double sharpness = 0.0;
  /// Mean squared standardised error of the best run.
  double least_misfit = 0.0;
};

/// Mean squared standardised error of each run; infinite = it is no prediction.
std::vector<double> misfits_of(const EpisodeRuns& runs);

/// `other_cause`: probability that the motion has nothing to do with the parameters.
EpisodeEvidence evidence_of(const EpisodeRuns& runs, const std::vector<belief::PhysicalDraw>& draws, double other_cause,
                            core::RandomStream stream);

}  // namespace prescene::filter
