// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/calibration/m_estimate.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "point_response.h"
#include "prescene/core/check.h"
#include "prescene/core/sobol.h"
#include "prescene/geometry/dense_solvers.h"
#include "reflect.h"

namespace prescene::simulation {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using geometry::product;

// Steps within a round: the linear functions are cheap, but hold about the trials only.
constexpr int kSteps = 12;
constexpr double kLongestStep = 0.5;  // Of the trials' spread, rms over parameters.
constexpr double kLongestMove = 2.0;  // Of all steps of a round together.
// By which the trials' spread changes from round to round at most, either way.
constexpr double kMostChange = 3.0;
// Of the trials, in the first ones' scales.
constexpr double kLeastSpread = 0.1;
// Of rounds that do not settle, as many are taken together.
constexpr std::size_t kUnsettledRounds = 8;
// Of the mean score, a logarithm: by less it differs by chance.
constexpr double kWorse = 0.1;

struct Problem {
  const std::vector<EstimatedParameter>& parameters;
  VectorXd prior_mean, precision, low, high;
};

Problem problem_of(const std::vector<EstimatedParameter>& parameters) {
  const auto n = static_cast<Index>(parameters.size());
  Problem problem{parameters, VectorXd(n), VectorXd(n), VectorXd(n), VectorXd(n)};
  for (Index i = 0; i < n; ++i) {
    const EstimatedParameter& p = parameters[static_cast<std::size_t>(i)];
    problem.prior_mean[i] = p.prior_mean;
    problem.precision[i] = 1.0 / (p.prior_deviation * p.prior_deviation);
    problem.low[i] = p.low;
    problem.high[i] = p.high;
  }
  return problem;
}

/// Where trials are made: values = center + factor u, u of standard deviation one.
struct Neighbourhood {
  VectorXd center;
  MatrixXd factor;  ///< Lower triangular.
};

/// Rows of u; the first is the middle.
MatrixXd trials_in(const Neighbourhood& around, const Problem& problem, Index count, std::uint64_t seed) {
  const Index n = around.center.size();
  const core::SobolNet net(static_cast<int>(n), seed);
  std::vector<double> uniform(static_cast<std::size_t>(n));
  MatrixXd trials = MatrixXd::Zero(count, n);
  for (Index trial = 1; trial < count; ++trial) {
    net.point(static_cast<std::size_t>(trial), uniform);
    VectorXd z(n);
    for (Index i = 0; i < n; ++i) z[i] = core::inverse_normal_cdf(uniform[static_cast<std::size_t>(i)]);
    VectorXd value = around.center + around.factor * z;
    for (Index i = 0; i < n; ++i) value[i] = reflected(value[i], problem.low[i], problem.high[i]);
    trials.row(trial) = geometry::solve_lower(around.factor, value - around.center).transpose();
  }
  return trials;
}

/// Of Student's distribution over that of the normal one at 95 % [Abramowitz & Stegun 1964, 26.7.5].
double student_factor(double freedom) {
  const double z = 1.6449;
  const double z2 = z * z;
  return 1.0 + (z2 + 1.0) / (4.0 * freedom) + (5.0 * z2 * z2 + 16.0 * z2 + 3.0) / (96.0 * freedom * freedom);
}

/// In u: where the scores and the prior agree, and the covariance there.
struct Step {
  VectorXd move;
  MatrixXd covariance;
};

/// `slopes`: of the recordings' scores at u; `curvature`: of their mean.
Step step_from(const VectorXd& u, const MatrixXd& slopes, const MatrixXd& curvature, const Neighbourhood& around,
               const Problem& problem) {
  const auto cases = static_cast<double>(slopes.rows());
  // Directions in which the scores do not rise say nothing.
  const geometry::SymmetricEigen eigen = geometry::symmetric_eigen(curvature);
  const MatrixXd H = product(eigen.vectors * eigen.values.cwiseMax(0.0).asDiagonal(), eigen.vectors.transpose());
  const VectorXd slope = slopes.colwise().mean().transpose();
  const MatrixXd centred = slopes.rowwise() - slope.transpose();
  // No freedom is taken off for the parameters: jumps of the simulation, which the trials see as slopes, widen the
  // spread of the slopes by as much (docs/reference/calibration.md has the count).
  MatrixXd B = product(centred.transpose(), centred) / (cases * (cases - 1.0));
  B *= std::pow(student_factor(cases - 1.0), 2);
  B.diagonal().array() += 1e-12 * B.trace() + 1e-300;
  const MatrixXd weights = geometry::solve_symmetric(B, H).transpose();  // H B^-1
  const MatrixXd prior = product(around.factor.transpose() * problem.precision.asDiagonal(), around.factor);
  const VectorXd pull = around.factor.transpose() *
                        problem.precision.cwiseProduct(problem.prior_mean - around.center - around.factor * u);
  Step step;
  step.covariance = geometry::inverse(product(weights, H) + prior);
  step.covariance = 0.5 * (step.covariance + step.covariance.transpose()).eval();
  step.move = step.covariance * (pull - weights * slope);
  return step;
}

double rms(const VectorXd& v) { return v.norm() / std::sqrt(static_cast<double>(v.size())); }

VectorXd shortened(const VectorXd& v, double longest) {
  const double length = rms(v);
  return length > longest ? VectorXd(v * (longest / length)) : v;
}

/// The next trials are spread as the estimate is uncertain, but no less than jumps of the simulation need.
Neighbourhood about(const VectorXd& center, const Neighbourhood& before, const MatrixXd& covariance, double reach,
                    const VectorXd& least) {
  const MatrixXd in_u =
      geometry::solve_lower(before.factor, geometry::solve_lower(before.factor, covariance).transpose());
  const geometry::SymmetricEigen eigen = geometry::symmetric_eigen(0.5 * (in_u + in_u.transpose()));
  const VectorXd lengths =
      (reach * eigen.values.cwiseMax(0.0).cwiseSqrt()).cwiseMax(1.0 / kMostChange).cwiseMin(kMostChange);
  const MatrixXd factor = product(before.factor, eigen.vectors) * lengths.asDiagonal();
  MatrixXd spread = product(factor, factor.transpose());
  spread.diagonal() += least.cwiseAbs2();
  return {center, geometry::cholesky_factor(spread)};
}

/// What one round says.
struct RoundEstimate {
  VectorXd value;
  MatrixXd covariance;
  std::vector<VectorXd> without;  ///< For each fold, the value without its recordings.
};

/// In u, from `u`: where the others' scores and the prior agree, for each fold.
std::vector<VectorXd> without_folds(const VectorXd& u, const PointResponse& response, const Neighbourhood& around,
                                    const Problem& problem, const std::vector<int>& folds) {
  if (folds.empty()) return {};
  const MatrixXd slopes = response.slopes(u);
  const std::vector<MatrixXd> curvatures = response.curvatures(u);
  std::vector<VectorXd> all;
  for (int fold = 0; fold <= *std::ranges::max_element(folds); ++fold) {
    std::vector<Index> others;
    MatrixXd curvature = MatrixXd::Zero(u.size(), u.size());
    for (std::size_t i = 0; i < folds.size(); ++i) {
      if (folds[i] == fold) continue;
      others.push_back(static_cast<Index>(i));
      curvature += curvatures[i];
    }
    curvature = (0.5 * (curvature + curvature.transpose()) / static_cast<double>(others.size())).eval();
    const Step step = step_from(u, slopes(others, Eigen::all), curvature, around, problem);
    all.push_back(around.center + around.factor * (u + shortened(step.move, kLongestStep)));
  }
  return all;
}

RoundEstimate estimate_of(const PointResponse& response, const Neighbourhood& around, const Problem& problem,
                          const std::vector<int>& folds) {
  VectorXd u = VectorXd::Zero(around.center.size());
  Step step;
  for (int k = 0; k < kSteps; ++k) {
    step = step_from(u, response.slopes(u), response.curvature(u), around, problem);
    u = shortened(u + shortened(step.move, kLongestStep), kLongestMove);
  }
  return {around.center + around.factor * u,
          product(product(around.factor, step.covariance), around.factor.transpose()),
          without_folds(u, response, around, problem, folds)};
}

/// Their mean; its error by how much they differ is added. Of rounds that did not settle, which may follow each other,
/// this is how much one differs.
void combine(std::span<const RoundEstimate> rounds, bool settled, Estimate* result) {
  const auto count = static_cast<double>(rounds.size());
  result->value = VectorXd::Zero(result->value.size());
  result->covariance = MatrixXd::Zero(result->value.size(), result->value.size());
  for (const RoundEstimate& round : rounds) {
    result->value += round.value / count;
    result->covariance += round.covariance / count;
  }
  result->without.assign(rounds.front().without.size(), VectorXd::Zero(result->value.size()));
  for (const RoundEstimate& round : rounds)
    for (std::size_t fold = 0; fold < round.without.size(); ++fold)
      result->without[fold] += round.without[fold] / count;
  if (rounds.size() < 2) return;
  for (const RoundEstimate& round : rounds) {
    const VectorXd off = round.value - result->value;
    result->covariance += off * off.transpose() / ((settled ? count : 1.0) * (count - 1.0));
  }
}

double mean_score(const Observations& observations, const MatrixXd& simulated) {
  double sum = 0.0;
  for (const double score : recording_scores(observations, simulated)) sum += score;
  return sum / observations.count();
}

}  // namespace

core::Result<Estimate> m_estimate(const std::vector<EstimatedParameter>& parameters, const Observations& observations,
                                  const SimulatedPoints& simulate, core::RandomStream stream,
                                  const EstimateOptions& options, const EstimateProgress& progress) {
  const auto n = static_cast<Index>(parameters.size());
  PRESCENE_CHECK(observations.count() >= n + 3 && observations.samples > 1);
  PRESCENE_CHECK(options.folds.empty() || std::ssize(options.folds) == observations.count());
  const auto count = static_cast<Index>(std::ceil(options.trials * static_cast<double>(1 + n)));
  const Problem problem = problem_of(parameters);
  Neighbourhood around{VectorXd(n), MatrixXd::Zero(n, n)};
  for (Index i = 0; i < n; ++i) {
    const EstimatedParameter& p = parameters[static_cast<std::size_t>(i)];
    around.center[i] = std::clamp(p.value, p.low, p.high);
    around.factor(i, i) = p.scale;
  }
  const VectorXd least = kLeastSpread * around.factor.diagonal();
  Neighbourhood best = around;
  double best_score = std::numeric_limits<double>::infinity();
  Estimate result;
  std::vector<RoundEstimate> rounds;
  std::size_t settled = 0;  // The last of them.
  for (int round = 0; round < options.most_rounds && static_cast<int>(settled) < options.settled_rounds; ++round) {
    const MatrixXd trials = trials_in(around, problem, count, stream.next_u64());
    std::vector<MatrixXd> simulated;
    for (Index trial = 0; trial < count; ++trial) {
      const VectorXd value = around.center + around.factor * trials.row(trial).transpose();
      PRESCENE_TRY(MatrixXd points, simulate(std::span(value.data(), static_cast<std::size_t>(n))));
      simulated.push_back(std::move(points));
      ++result.evaluations;
      if (progress)
        progress((round + static_cast<double>(trial + 1) / static_cast<double>(count)) / options.most_rounds);
    }
    const double score = mean_score(observations, simulated[0]);
    if (score > best_score + kWorse) {
      // Too long a move: once more from the best, with closer trials.
      best.factor *= 0.5;
      around = best;
      settled = 0;
      continue;
    }
    if (score < best_score) {
      best = around;
      best_score = score;
    }
    const RoundEstimate found =
        estimate_of(PointResponse(observations, trials, simulated), around, problem, options.folds);
    const double moved =
        rms(geometry::solve_lower(geometry::cholesky_factor(found.covariance), found.value - around.center));
    if (settled > 0 || (round > 0 && moved < options.accuracy)) ++settled;
    rounds.push_back(found);
    around =
        about(found.value.cwiseMax(problem.low).cwiseMin(problem.high), around, found.covariance, options.reach, least);
  }
  result.settled = static_cast<int>(settled) == options.settled_rounds;
  const std::size_t kept = result.settled ? settled : std::min(rounds.size(), kUnsettledRounds);
  result.value = VectorXd::Zero(n);
  combine(std::span(rounds).last(kept), result.settled, &result);
  result.score = best_score;
  return result;
}

}  // namespace prescene::simulation
