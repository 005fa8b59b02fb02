// SPDX-License-Identifier: Apache-2.0
// Estimates of a simulator's parameters from independent recordings, and how far off they may be, where the simulated
// motions jump: they are never differentiated, but fitted by straight lines over trials that are spread as widely as
// the estimate is uncertain.
//
//   PRESCENE_TRY(const Estimate found, m_estimate(parameters, observations, simulate, stream));
//   ... found.value[0], found.standard_error(0)
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "prescene/core/random.h"
#include "prescene/core/status.h"

namespace prescene::simulation {

/// What was observed: a point in a space of any dimension for each view; a recording has one view or several.
struct Observations {
  Eigen::MatrixXd points;       ///< One column a view.
  std::vector<int> recordings;  ///< That each view belongs to: 0, 1, ... in ascending order, none left out.
  int samples = 0;              ///< Simulated points a view, > 1.
  double width = 0.0;           ///< See recording_scores(), > 0.

  int count() const { return recordings.empty() ? 0 : recordings.back() + 1; }
};

/// Simulated points under some values: a view's samples are columns beside each other, views in their order. The same
/// random numbers in each call.
using SimulatedPoints = std::function<core::Result<Eigen::MatrixXd>(std::span<const double> values)>;

/// Of each recording the mean over its views of the kernel score with the distance ln(1 + (d / width)^2) / 2, which is
/// proper as the energy score is [Gneiting & Raftery 2007, 5.1]. A motion that came out quite differently, as a
/// cube does that tips or just does not, costs the logarithm of how differently, so that it does not outweigh all
/// others. simulated.cols() == observations.points.cols() * observations.samples.
std::vector<double> recording_scores(const Observations& observations, const Eigen::MatrixXd& simulated);

struct EstimatedParameter {
  std::string name;
  double value = 0.0;  ///< Where to begin.
  double scale = 0.0;  ///< Of the first trials, > 0.
  double low = 0.0;    ///< Trials stay in [low, high].
  double high = 0.0;
  double prior_mean = 0.0;       ///< Believed before, a Gaussian.
  double prior_deviation = 0.0;  ///< > 0
};

struct EstimateOptions {
  int most_rounds = 16;
  int settled_rounds = 4;  ///< Whose mean is the estimate, and whose differences are part of its error, > 0.
  double trials = 3.0;     ///< Of a round, for each coefficient of a straight line, > 1.
  double reach = 2.0;      ///< Of the trials, in standard errors of the estimate, > 0.
  double accuracy = 1.0;   ///< Settled is what moves by less in a round, in standard errors, rms over parameters.
  std::vector<int> folds;  ///< Of each recording, 0, 1, ...: see Estimate::without; empty for none.
};

struct Estimate {
  Eigen::VectorXd value;
  Eigen::MatrixXd covariance;
  double score = 0.0;  ///< Mean over recordings, near the value.
  int evaluations = 0;
  bool settled = false;  ///< Else it ended at its number of rounds.
  /// For each fold the value without its recordings: one Newton step from the value, as a jackknife of an M-estimate
  /// takes it [Shao & Tu 1995, 2.1].
  std::vector<Eigen::VectorXd> without;

  double standard_error(Eigen::Index i) const { return std::sqrt(covariance(i, i)); }
};

/// Called after each trial with the share that is done, at most.
using EstimateProgress = std::function<void(double)>;

/// The values that make the mean score least, and the covariance of their errors as of an M-estimate over independent
/// recordings [Huber 1967], with the prior added. Each round fits every simulated point by a linear function of the
/// values, over trials about the estimate so far, and takes the scores of these functions: Gauss-Newton steps without
/// derivatives. Where the functions miss the points, distances count less. Errors are widened
/// by Student's factor, such that 1.645 of them hold 90 %. Takes at least parameters + 3 recordings. Fails as
/// `simulate` does.
core::Result<Estimate> m_estimate(const std::vector<EstimatedParameter>& parameters, const Observations& observations,
                                  const SimulatedPoints& simulate, core::RandomStream stream,
                                  const EstimateOptions& options = {}, const EstimateProgress& progress = {});

}  // namespace prescene::simulation
