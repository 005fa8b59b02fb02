// SPDX-License-Identifier: Apache-2.0
// Accuracy and honesty of the estimator on problems with known probabilities.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <iterator>
#include <utility>

#include "toy_problems.h"

namespace prescene::simulation {
namespace {

using tests::ToyProblem;

OutcomeEstimate estimate(const ToyProblem& problem, std::uint64_t seed, const EstimatorOptions& options,
                         core::ThreadPool& pool) {
  const tests::FakeSimulator simulator = tests::standing_still();
  const std::vector<Variable> variables = problem.variables();
  return estimate_outcomes(simulator, problem.starts(), variables, {}, core::RandomStream(seed, core::Purpose::kTest),
                           options, pool);
}

/// Half the sum of absolute differences.
double total_variation(const VariableEstimate& estimate, const std::vector<double>& truth) {
  double sum = 0.0;
  for (std::size_t c = 0; c < truth.size(); ++c) sum += std::abs(estimate.classes[c].probability - truth[c]);
  return 0.5 * sum;
}

struct Accuracy {
  double net = 0.0;          ///< RMS total variation of nets,
  double monte_carlo = 0.0;  ///< of as many independent draws.
};
Accuracy accuracy(const ToyProblem& problem, int count, int repetitions) {
  core::ThreadPool pool(1);
  const StartComponent start = tests::normal_starts(problem.dimensions);
  Accuracy result;
  for (int r = 0; r < repetitions; ++r) {
    EstimatorOptions options;
    options.exact_instances = count;
    const OutcomeEstimate net = estimate(problem, static_cast<std::uint64_t>(r), options, pool);
    const double net_error = total_variation(net.variables[0], problem.probabilities);
    result.net += net_error * net_error / repetitions;

    core::RandomStream stream(static_cast<std::uint64_t>(r), core::Purpose::kEvaluation);
    std::vector<double> u(static_cast<std::size_t>(problem.dimensions));
    VariableEstimate drawn;
    drawn.classes.resize(problem.probabilities.size());
    for (int i = 0; i < count; ++i) {
      for (double& x : u) x = stream.uniform();
      drawn.classes[static_cast<std::size_t>(problem.classify(start.draw(u)))].probability += 1.0 / count;
    }
    const double error = total_variation(drawn, problem.probabilities);
    result.monte_carlo += error * error / repetitions;
  }
  return {std::sqrt(result.net), std::sqrt(result.monte_carlo)};
}

TEST(OutcomeEstimatorStatistics, NetsBeatIndependentDrawsWhereTheOutcomeIsSmooth) {
  const Accuracy one = accuracy(tests::one_boundary(), 512, 64);
  EXPECT_LT(one.net, 0.6 * one.monte_carlo) << one.net << " " << one.monte_carlo;
  const Accuracy curved = accuracy(tests::curved_boundary(), 512, 64);
  EXPECT_LT(curved.net, 0.8 * curved.monte_carlo) << curved.net << " " << curved.monte_carlo;
}

TEST(OutcomeEstimatorStatistics, NetsLoseNothingWhereTheOutcomeIsChaotic) {
  // 1.1 is the bound; the ratio of two RMS values of 200 repetitions and some five classes has a deviation of about 4
  // %.
  const Accuracy chaos = accuracy(tests::chaotic(), 512, 200);
  EXPECT_LT(chaos.net, 1.1 * chaos.monte_carlo) << chaos.net << " " << chaos.monte_carlo;
}

/// Share of seeds, worst over the classes, whose interval contains the truth when the program stops by itself.
struct Coverage {
  double worst = 1.0;
  double mean = 0.0;
  double instances = 0.0;
};
Coverage coverage(const ToyProblem& problem, double tolerance, double confidence, int seeds) {
  core::ThreadPool pool(1);
  std::vector<int> covered(problem.probabilities.size(), 0);
  Coverage result;
  for (int s = 0; s < seeds; ++s) {
    EstimatorOptions options;
    options.tolerance = tolerance;
    options.confidence = confidence;
    const OutcomeEstimate found = estimate(problem, 1000 + static_cast<std::uint64_t>(s), options, pool);
    EXPECT_TRUE(found.converged);
    result.instances += static_cast<double>(found.instances.size()) / seeds;
    for (std::size_t c = 0; c < covered.size(); ++c) {
      const ClassEstimate& one = found.variables[0].classes[c];
      covered[c] += one.low <= problem.probabilities[c] && problem.probabilities[c] <= one.high ? 1 : 0;
    }
  }
  for (int c : covered) {
    const double share = static_cast<double>(c) / seeds;
    result.worst = std::min(result.worst, share);
    result.mean += share / static_cast<double>(covered.size());
  }
  return result;
}

TEST(OutcomeEstimatorStatistics, IntervalsCoverAsStatedWhenTheProgramStopsByItself) {
  // 180 of 200 is what a coverage of 0.95 falls below once in a thousand times.
  for (const ToyProblem& problem : {tests::one_boundary(), tests::curved_boundary(), tests::chaotic()}) {
    for (double tolerance : {0.03, 0.02}) {
      const Coverage found = coverage(problem, tolerance, 0.95, 200);
      EXPECT_GE(found.worst, 0.90) << problem.name << " +-" << tolerance;
      EXPECT_GE(found.mean, 0.93) << problem.name << " +-" << tolerance;
      RecordProperty(problem.name + " +-" + std::to_string(tolerance), std::to_string(found.mean));
    }
  }
}

/// Classes of independent draws, two of them rare: a net over the starts is of no use.
ToyProblem independent_draws() {
  return {
      "independent draws", 1, {0.01, 0.05, 0.1, 0.84}, [](const belief::WorldState& s) {
        const double u =
            core::RandomStream(std::bit_cast<std::uint64_t>(tests::z_of(s, 0)), core::Purpose::kEvaluation).uniform();
        const double ends[] = {0.01, 0.06, 0.16};
        return static_cast<int>(std::upper_bound(std::begin(ends), std::end(ends), u) - std::begin(ends));
      }};
}

/// As many of n events of this probability as are exceeded once in 10,000 times.
int most_by_chance(int n, double probability) {
  double mass = std::pow(1.0 - probability, n), above = 1.0 - mass;  // of exactly k, and of more
  int k = 0;
  for (; above > 1e-4; ++k) {
    mass *= static_cast<double>(n - k) / (k + 1) * probability / (1.0 - probability);
    above -= mass;
  }
  return k;
}

/// How many of `seeds` had an interval without the truth, at each of the looks and at any of them, worst of all
/// classes.
struct MissesOfLooks {
  static constexpr int kInstances = 128;
  static constexpr std::size_t kLooks = 5;  // after 16, 32, 64, 96 and 128 instances
  std::array<int, kLooks> at = {};
  int at_any = 0;
};
MissesOfLooks misses_of_looks(const ToyProblem& problem, int seeds) {
  core::ThreadPool pool(1);
  const std::size_t classes = problem.probabilities.size();
  std::vector<std::array<int, MissesOfLooks::kLooks>> at(classes);
  std::vector<int> at_any(classes, 0);
  for (int s = 0; s < seeds; ++s) {
    std::vector<std::uint8_t> missed(classes, 0);
    std::size_t looks = 0;
    EstimatorOptions options;
    options.exact_instances = MissesOfLooks::kInstances;
    options.on_look = [&](const OutcomeEstimate& so_far) {
      for (std::size_t c = 0; c < classes && looks < MissesOfLooks::kLooks; ++c) {
        const ClassEstimate& one = so_far.variables[0].classes[c];
        if (one.low <= problem.probabilities[c] && problem.probabilities[c] <= one.high) continue;
        ++at[c][looks];
        missed[c] = 1;
      }
      ++looks;
    };
    static_cast<void>(estimate(problem, 2000 + static_cast<std::uint64_t>(s), options, pool));
    EXPECT_EQ(looks, MissesOfLooks::kLooks);
    for (std::size_t c = 0; c < classes; ++c) at_any[c] += missed[c];
  }
  MissesOfLooks worst;
  for (std::size_t c = 0; c < classes; ++c) {
    worst.at_any = std::max(worst.at_any, at_any[c]);
    for (std::size_t k = 0; k < worst.at.size(); ++k) worst.at[k] = std::max(worst.at[k], at[c][k]);
  }
  return worst;
}

// Whoever looks at each stage, and keeps the worst of what was told, is right as often as stated.
TEST(OutcomeEstimatorStatistics, IntervalsOfAllLooksHoldTogether) {
  constexpr double kError = 0.05;  // of the default confidence
  const std::pair<ToyProblem, int> problems[] = {{independent_draws(), 2000}, {tests::one_boundary(), 300}};
  for (const auto& [problem, seeds] : problems) {
    const MissesOfLooks misses = misses_of_looks(problem, seeds);
    double error_of_all = 0.0;
    for (std::size_t k = 0; k < misses.at.size(); ++k) {
      const double error = kError * (k == 0 ? 0.125 : 0.875 / static_cast<double>(k * (k + 1)));
      error_of_all += error;
      EXPECT_LE(misses.at[k], most_by_chance(seeds, error)) << problem.name << ", look " << k;
    }
    EXPECT_LE(misses.at_any, most_by_chance(seeds, error_of_all)) << problem.name;
  }
}

TEST(OutcomeEstimatorStatistics, ConfidenceIsAParameter) {
  const ToyProblem problem = tests::chaotic();
  const Coverage narrow = coverage(problem, 0.02, 0.8, 200), wide = coverage(problem, 0.02, 0.99, 100);
  EXPECT_NEAR(narrow.mean, 0.8, 0.05);
  EXPECT_GE(wide.mean, 0.98);
}

TEST(OutcomeEstimatorStatistics, SmoothProblemsTakeFewerInstancesAndChaoticOnesNoMoreThanIndependentDraws) {
  // Wald's interval of the largest class reaches a half width h at N = z^2 p (1 - p) / h^2.
  const double z = core::inverse_normal_cdf(0.975), h = 0.02;
  const auto wald = [&](double p) { return z * z * p * (1.0 - p) / (h * h); };
  EXPECT_LT(coverage(tests::one_boundary(), h, 0.95, 50).instances, 0.4 * wald(tests::one_boundary().probabilities[0]));
  // The net grows by factors of 4/3 and 3/2, so it overshoots by at most a half.
  EXPECT_LT(coverage(tests::chaotic(), h, 0.95, 50).instances, 1.5 * wald(0.35));
}

}  // namespace
}  // namespace prescene::simulation
