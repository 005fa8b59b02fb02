// SPDX-License-Identifier: Apache-2.0
// Scores by hand and against closed forms.
#include "prescene/service/calibration/forecast_scores.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "prescene/core/random.h"
#include "prescene/service/evaluate/cube_model.h"

namespace prescene::service {
namespace {

TEST(ForecastScores, BrierAndLogByHand) {
  const std::vector<double> p = {0.7, 0.2, 0.1, 0.0, 0.0, 0.0};
  EXPECT_DOUBLE_EQ(brier_score(p, 0), 0.09 + 0.04 + 0.01);
  EXPECT_DOUBLE_EQ(brier_score(p, 1), 0.49 + 0.64 + 0.01);
  EXPECT_DOUBLE_EQ(brier_score(p, 5), 0.49 + 0.04 + 0.01 + 1.0);
  EXPECT_DOUBLE_EQ(brier_score(std::vector<double>(6, 1.0 / 6.0), 2), 5.0 / 6.0);
  EXPECT_DOUBLE_EQ(log_score(p, 1), std::log(0.2));
  EXPECT_DOUBLE_EQ(log_score(p, 4), std::log(1e-3));
  EXPECT_EQ(mode_of(p), 0);
}

TEST(ForecastScores, ProbabilitiesOfCounts) {
  const std::vector<int> counts = {61, 0, 0, 0, 0, 0};
  const std::vector<double> p = probabilities_of(counts);
  EXPECT_DOUBLE_EQ(p[0], 61.5 / 64.0);
  EXPECT_DOUBLE_EQ(p[3], 0.5 / 64.0);
}

TEST(ForecastScores, QuantilesInterpolate) {
  EXPECT_DOUBLE_EQ(quantile({4.0, 1.0, 3.0, 2.0}, 0.5), 2.5);
  EXPECT_DOUBLE_EQ(quantile({4.0, 1.0, 3.0, 2.0}, 0.9), 3.7);
  EXPECT_DOUBLE_EQ(quantile({7.0}, 0.9), 7.0);
}

TEST(ForecastScores, EnergyScoreByHand) {
  const std::vector<Eigen::Vector2d> samples = {{0.0, 0.0}, {4.0, 0.0}};
  EXPECT_DOUBLE_EQ(energy_score(samples, {0.0, 3.0}), 0.5 * (3.0 + 5.0) - 0.5 * 4.0);
}

TEST(ForecastScores, RegionMassOfOneGaussianIsItsChiSquare) {
  // One sample: a Gaussian of deviation 3 mm; the region through a point at r has the mass 1 - exp(-r^2 / 2 s^2).
  const std::vector<int> groups = {0};
  const PlaneDensity density = density_of({{0.1, 0.2}}, groups, 0.7, 0.003);
  EXPECT_EQ(region_mass(density, {0.1, 0.2}), 0.0);
  EXPECT_NEAR(region_mass(density, Eigen::Vector2d(0.1 + 0.003 * std::sqrt(2.0 * std::log(2.0)), 0.2)), 0.5, 0.13);
  EXPECT_EQ(region_mass(density, {0.2, 0.2}), 1.0);
}

TEST(ForecastScores, RegionsCoverWhatTheyPromise) {
  // Truths from the distribution that the samples come from, two far groups: regions of mass m hold a share m of them.
  core::RandomStream stream(3, core::Purpose::kTest);
  const auto draw = [&](int& group) {
    group = stream.uniform() < 0.3 ? 1 : 0;
    const double y = 0.005 * stream.normal(), x = 0.02 * stream.normal();
    const Eigen::Vector2d z(x, y);
    return Eigen::Vector2d(z + Eigen::Vector2d(group * 0.3, 0.0));
  };
  const int repeats = 300;
  int inside_50 = 0;
  int inside_90 = 0;
  for (int r = 0; r < repeats; ++r) {
    std::vector<Eigen::Vector2d> samples;
    std::vector<int> groups(64);
    for (int& group : groups) samples.push_back(draw(group));
    int group = 0;
    const Eigen::Vector2d truth = draw(group);
    const double mass = region_mass(density_of(samples, groups, CubeModel().kernel_scale, 1e-4), truth);
    inside_50 += mass < 0.5;
    inside_90 += mass < 0.9;
  }
  // Three binomial deviations.
  EXPECT_NEAR(inside_50 / double(repeats), 0.5, 0.087);
  EXPECT_NEAR(inside_90 / double(repeats), 0.9, 0.052);
}

/// Points of the plane, normally distributed with deviation `sigma` in x and in y.
std::vector<Eigen::Vector2d> normal_points(double sigma, int count, core::RandomStream& stream) {
  std::vector<Eigen::Vector2d> points;
  for (int i = 0; i < count; ++i) {
    const double x = sigma * stream.normal();
    points.emplace_back(x, sigma * stream.normal());
  }
  return points;
}

TEST(ForecastScores, RegionMassUnderANormalDistributionIsItsChiSquare) {
  core::RandomStream stream(5, core::Purpose::kTest);
  const double sigma = 0.02;
  const int count = 512;
  const double scale = 0.7;
  const PlaneDensity density = density_of(normal_points(sigma, count, stream), std::vector<int>(count, 0), scale, 1e-4);
  // The kernels widen the distribution.
  const double wide = sigma * sigma * (1.0 + scale * scale * std::pow(count, -1.0 / 3.0));
  for (const double mass : {0.2, 0.5, 0.8, 0.95}) {
    const double radius = std::sqrt(-2.0 * wide * std::log(1.0 - mass));
    double sum = 0.0;
    const int directions = 4;
    for (int k = 0; k < directions; ++k) {
      const double angle = 2.0 * std::numbers::pi * k / directions;
      sum += region_mass(density, radius * Eigen::Vector2d(std::cos(angle), std::sin(angle))) / directions;
    }
    EXPECT_NEAR(sum, mass, 0.05) << mass;
  }
}

TEST(ForecastScores, EnergyScoreOfANormalDistributionHasItsClosedForm) {
  // Two points of the plane with deviation s each coordinate are s sqrt(pi) apart on average, each s sqrt(pi / 2) from
  // the middle.
  core::RandomStream stream(6, core::Purpose::kTest);
  const double pi = std::numbers::pi;
  double mean = 0.0;
  const int repeats = 40;
  for (int r = 0; r < repeats; ++r) mean += energy_score(normal_points(0.01, 64, stream), {0.0, 0.0}) / repeats;
  // One deviation of this mean is about 0.01 mm.
  EXPECT_NEAR(mean, 0.01 * (std::sqrt(0.5 * pi) - 0.5 * std::sqrt(pi)), 5e-5);
}

TEST(ForecastScores, EnergyScoreIsLeastForTheTruthWithFewSamplesToo) {
  // Expected score of a forecast of deviation f when the truth has s: sqrt(pi / 2 (f^2 + s^2)) - f sqrt(pi) / 2.
  core::RandomStream stream(7, core::Purpose::kTest);
  const double pi = std::numbers::pi;
  const int repeats = 4000;
  double least = 1.0;
  double best = 0.0;
  for (const double f : {0.5, 1.0, 2.0}) {
    double mean = 0.0;
    for (int r = 0; r < repeats; ++r) {
      const Eigen::Vector2d truth = normal_points(1.0, 1, stream)[0];
      mean += energy_score(normal_points(f, 4, stream), truth) / repeats;
    }
    EXPECT_NEAR(mean, std::sqrt(0.5 * pi * (f * f + 1.0)) - 0.5 * f * std::sqrt(pi), 0.06) << f;
    if (mean < least || best == 0.0) {
      least = mean;
      best = f;
    }
  }
  EXPECT_EQ(best, 1.0);
}

}  // namespace
}  // namespace prescene::service
