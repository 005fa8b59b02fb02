// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>
#include <string>
#include <utility>

#include "prescene/belief/event.h"
#include "prescene/queries/explain.h"
#include "prescene/queries/tempered_smc.h"

namespace prescene::queries {
namespace {

/// A Gaussian likelihood of the first coordinate, whose posterior and evidence under the standard normal are known.
struct GaussianCase {
  double mean = 0.0, deviation = 1.0;

  double log_likelihood(const LatentPoint& z) const {
    const double d = (z[0] - mean) / deviation;
    return -0.5 * d * d;
  }
  double log_evidence() const {
    const double variance = 1.0 + deviation * deviation;
    return std::log(deviation) - 0.5 * std::log(variance) - 0.5 * mean * mean / variance;
  }
  double posterior_mean() const { return mean / (1.0 + deviation * deviation); }
};

TemperedTarget target_of(const GaussianCase& gaussian) {
  TemperedTarget target;
  target.dimensions = 3;
  target.moved = 2;
  target.evaluate = [gaussian](std::span<const LatentPoint> points, std::span<double> log_likelihoods) {
    for (std::size_t i = 0; i < points.size(); ++i) log_likelihoods[i] = gaussian.log_likelihood(points[i]);
  };
  return target;
}

TemperedResult solve(const GaussianCase& gaussian, bool guess, std::uint64_t seed, TemperedOptions options = {}) {
  TemperedTarget target = target_of(gaussian);
  if (guess) {
    target.guess_mean = {gaussian.mean, 0.0};
    target.guess_deviation = {0.3, 1.0};
  }
  return tempered_posterior(target, options, core::RandomStream(seed, core::Purpose::kTest));
}

TEST(TemperedPosterior, HasTheEvidenceAndTheMeanOfAGaussian) {
  for (const GaussianCase& gaussian : {GaussianCase{0.5, 1.0}, GaussianCase{1.5, 0.1}, GaussianCase{-2.5, 0.05}})
    for (const bool guess : {false, true}) {
      TemperedOptions options;
      options.runs = 8;
      options.points = 200;
      const TemperedResult result = solve(gaussian, guess, 7, options);
      // Five standard errors of either, and what few runs leave open of those.
      EXPECT_NEAR(result.mean_log_evidence, gaussian.log_evidence(), 5.0 * result.error + 0.05)
          << gaussian.mean << " " << guess;
      double mean = 0.0, weight = 0.0;
      for (const TemperedPoint& point : result.points) mean += point.weight * point.z[0], weight += point.weight;
      EXPECT_NEAR(weight, 1.0, 1e-9);
      EXPECT_NEAR(mean, gaussian.posterior_mean(), 5.0 * gaussian.deviation / std::sqrt(100.0));
    }
}

// A proposal changes how much work it takes and how much the runs scatter, but not the evidence, even if it is wrong.
TEST(TemperedPosterior, HasTheSameEvidenceWhereverItIsProposedFrom) {
  const GaussianCase gaussian{1.5, 0.05}, elsewhere{-1.0, 0.2};
  TemperedOptions options;
  options.runs = 16;
  options.points = 48;
  options.first_points = 2;
  TemperedTarget target = target_of(gaussian);
  const TemperedResult plain = tempered_posterior(target, options, core::RandomStream(5, core::Purpose::kTest));
  propose_from(plain, target);
  const TemperedResult again = tempered_posterior(target, options, core::RandomStream(6, core::Purpose::kTest));
  EXPECT_NEAR(again.mean_log_evidence, gaussian.log_evidence(), 5.0 * again.error + 0.05);
  EXPECT_LT(again.evaluations, plain.evaluations);
  EXPECT_LT(again.error, plain.error);
  propose_from(solve(elsewhere, false, 7, options), target);
  const TemperedResult wrong = tempered_posterior(target, options, core::RandomStream(8, core::Purpose::kTest));
  EXPECT_NEAR(wrong.mean_log_evidence, gaussian.log_evidence(), 5.0 * wrong.error + 0.05);
}

TEST(TemperedPosterior, RepeatsItsBits) {
  const GaussianCase gaussian{1.0, 0.2};
  const TemperedResult a = solve(gaussian, true, 3), b = solve(gaussian, true, 3), c = solve(gaussian, true, 4);
  EXPECT_EQ(a.log_evidence, b.log_evidence);
  EXPECT_NE(a.log_evidence, c.log_evidence);
}

TEST(TemperedPosterior, MergedRunsAreThoseOfOneCall) {
  const GaussianCase gaussian{1.0, 0.2};
  TemperedOptions options;
  options.runs = 5;
  const TemperedResult all = solve(gaussian, true, 3, options);
  options.runs = 2;
  const TemperedResult first = solve(gaussian, true, 3, options);
  options.runs = 3;
  options.first_run = 2;
  const TemperedResult both = merge(first, solve(gaussian, true, 3, options));
  EXPECT_EQ(both.log_evidence, all.log_evidence);
  EXPECT_EQ(both.mean_log_evidence, all.mean_log_evidence);
  EXPECT_EQ(both.error, all.error);
  EXPECT_EQ(both.evaluations, all.evaluations);
  ASSERT_EQ(both.points.size(), all.points.size());
  for (std::size_t i = 0; i < all.points.size(); ++i) {
    EXPECT_EQ(both.points[i].z, all.points[i].z);
    EXPECT_NEAR(both.points[i].weight, all.points[i].weight, 1e-12);
  }
}

// A log likelihood of at most -50 is far from the wanted evidence, so that no run needs all its steps.
TEST(TemperedPosterior, GivesUpWhatCannotReachTheWantedEvidence) {
  int calls = 0;
  TemperedTarget target;
  target.dimensions = target.moved = 1;
  target.evaluate = [&](std::span<const LatentPoint> points, std::span<double> log_likelihoods) {
    ++calls;
    for (std::size_t i = 0; i < points.size(); ++i)
      log_likelihoods[i] = -50.0 - 200.0 * (points[i][0] - 1.0) * (points[i][0] - 1.0);
  };
  TemperedOptions options;
  const core::RandomStream stream(1, core::Purpose::kTest);
  const TemperedResult searched = tempered_posterior(target, options, stream);
  const int all_calls = std::exchange(calls, 0);
  options.most_likely = 0.0;
  options.give_up_below = -20.0;
  const TemperedResult given_up = tempered_posterior(target, options, stream);
  EXPECT_TRUE(given_up.gave_up);
  EXPECT_LT(calls, all_calls);
  // Its evidence is an upper bound that is low enough.
  EXPECT_LT(given_up.mean_log_evidence, options.give_up_below);
  EXPECT_GT(given_up.mean_log_evidence, searched.mean_log_evidence);
  // What could still reach it is searched to the end, with the same bits.
  options.give_up_below = -70.0;
  const TemperedResult again = tempered_posterior(target, options, stream);
  EXPECT_FALSE(again.gave_up);
  EXPECT_EQ(again.log_evidence, searched.log_evidence);
}

// The rest of the path is one step then: the evidence is without bias, and the result says that it is unfinished.
TEST(TemperedPosterior, EndsWhenTheTimeIsOut) {
  TemperedTarget target;
  target.dimensions = target.moved = 1;
  int calls = 0;
  target.evaluate = [&](std::span<const LatentPoint> points, std::span<double> log_likelihoods) {
    ++calls;
    for (std::size_t i = 0; i < points.size(); ++i)
      log_likelihoods[i] = -200.0 * (points[i][0] - 1.0) * (points[i][0] - 1.0);
  };
  const core::RandomStream stream(1, core::Purpose::kTest);
  const TemperedResult searched = tempered_posterior(target, {}, stream);
  EXPECT_FALSE(searched.unfinished);
  const int all_calls = std::exchange(calls, 0);
  TemperedOptions options;
  options.runs = 512;
  options.most_likely = 0.0;
  options.out_of_time = [&] { return calls >= 1; };
  const TemperedResult in_one_step = tempered_posterior(target, options, stream);
  EXPECT_EQ(calls, 1);
  EXPECT_LT(calls, all_calls);
  EXPECT_TRUE(in_one_step.unfinished);
  EXPECT_GE(in_one_step.at_most, searched.mean_log_evidence);
  EXPECT_FALSE(in_one_step.cut_short);
  EXPECT_NEAR(in_one_step.mean_log_evidence, -0.5 * std::log(401.0) - 0.5 * 400.0 / 401.0, 0.1);
  // Time enough changes no bit.
  options = {};
  options.out_of_time = [] { return false; };
  EXPECT_EQ(tempered_posterior(target, options, stream).log_evidence, searched.log_evidence);
}

TEST(TemperedPosterior, OfAnImpossibleLikelihoodIsFinite) {
  TemperedTarget target;
  target.dimensions = target.moved = 1;
  target.evaluate = [](std::span<const LatentPoint>, std::span<double> log_likelihoods) {
    for (double& value : log_likelihoods) value = -INFINITY;
  };
  const TemperedResult result = tempered_posterior(target, {}, core::RandomStream(1, core::Purpose::kTest));
  EXPECT_LT(result.mean_log_evidence, -1e4);
  EXPECT_TRUE(std::isfinite(result.mean_log_evidence));
}

TEST(Explain, RefusesQueriesThatAreOutOfRangeAndWindowsThatAreNone) {
  ExplainQuery query;
  query.frames = 1;
  EXPECT_NE(validate(query).message().find("frames: give 2 to 64"), std::string::npos);
  query = {};
  query.weights.weight.fill(0.0);
  EXPECT_NE(validate(query).message().find("events"), std::string::npos);
  query = {};
  const auto none = explain({}, query, {});
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(none.status().code(), core::StatusCode::kInvalidInput);
}

TEST(Events, NamesAndKindsAreOneToOne) {
  std::set<std::string> names;
  for (std::size_t i = 0; i < belief::kEventKinds; ++i)
    names.insert(belief::name_of(static_cast<belief::EventKind>(i)));
  EXPECT_EQ(names.size(), belief::kEventKinds);
  EXPECT_STREQ(belief::name_of(belief::EventKind::kNothing), "nothing");
  EXPECT_STREQ(belief::name_of(belief::EventKind::kOther), "other");
}

}  // namespace
}  // namespace prescene::queries
