// SPDX-License-Identifier: Apache-2.0
// The shipped tempering against simulated frames with known truth. Thresholds state their false-alarm rate.
#include "prescene/service/evaluate/credible_regions.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace prescene::service {
namespace {

using geometry::Matrix6d;
using geometry::Vector6d;

const CoverageRow& row_of(const CredibleRegionReport& report, const std::string& group) {
  const auto found =
      std::find_if(report.rows.begin(), report.rows.end(), [&](const CoverageRow& row) { return row.group == group; });
  EXPECT_NE(found, report.rows.end()) << group;
  return *found;
}

/// A share is calibrated when it is 90 % within 3 points and four standard errors of n frames: of a share that is, one
/// in 16 000 tests says otherwise.
double margin(int n) { return 0.03 + 4.0 * std::sqrt(0.9 * 0.1 / n); }

TEST(ImportanceSampling, MassesOfAGaussianAreThoseOfChiSquared) {
  // The target is far from the start in place and width, and correlated.
  Matrix6d root = Matrix6d::Identity();
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < i; ++j) root(i, j) = 0.3 * std::sin(1.0 + i + 2.0 * j);
  Vector6d mean;
  mean << 1.0, -0.5, 0.3, 2.0, 0.0, -1.0;
  const Matrix6d information = (0.01 * root * root.transpose()).inverse();
  const LogDensity target = [&](std::span<const Vector6d> points, std::span<double> log_densities) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Vector6d d = points[i] - mean;
      log_densities[i] = 7.0 - 0.5 * d.dot(information * d);
    }
  };
  core::RandomStream stream(5, core::Purpose::kTest);
  ImportanceOptions options;
  options.samples = 20000;
  const ImportanceSamples samples = sample_by_importance(target, {}, options, stream);
  EXPECT_GT(samples.effective, 5000.0);
  EXPECT_LT((samples.fitted.mean - mean).norm(), 0.02);
  // Five standard errors of a share of 5000 are at most 0.035. Quantiles of chi-squared with six degrees of freedom.
  for (const auto& [squared, share] : {std::pair{2.204, 0.1}, {5.348, 0.5}, {10.645, 0.9}, {16.812, 0.99}})
    EXPECT_NEAR(samples.mass_above(7.0 - 0.5 * squared), share, 0.035);
  EXPECT_EQ(samples.mass_above(7.5), 0.0);
}

TEST(CredibleRegions, OfTheShippedTemperingHoldTheTruthAsOftenAsTheySay) {
  CredibleRegionOptions options;
  options.frames = 240;
  options.factors = {1.0};
  options.widths = {80, 160};
  core::ThreadPool threads;
  const auto frames = frame_posteriors(options, 6, threads);
  ASSERT_TRUE(frames.ok()) << frames.status().message();
  const CredibleRegionReport report = coverage(*frames, options.factors);
  for (const char* group : {"80 px", "160 px"}) {
    const CoverageRow& row = row_of(report, group);
    EXPECT_GT(row.n, 180);
    EXPECT_NEAR(row.weights_90[0], 0.9, margin(row.n)) << group;
    EXPECT_NEAR(row.information_90[0], 0.9, margin(row.n)) << group;
  }
}

TEST(CredibleRegions, WithoutTemperingMissTheTruth) {
  CredibleRegionOptions options;
  options.frames = 48;
  options.factors = {1.0};
  options.widths = {160};
  options.tempering = {{0.0, 0.0}, {0.0, 0.0}};
  core::ThreadPool threads;
  const auto frames = frame_posteriors(options, 6, threads);
  ASSERT_TRUE(frames.ok()) << frames.status().message();
  const CredibleRegionReport report = coverage(*frames, options.factors);
  EXPECT_LT(report.rows[0].weights_90[0], 0.5);
  EXPECT_LT(report.rows[0].information_90[0], 0.6);
}

TEST(CredibleRegions, CountsByWidthDistanceAndObject) {
  FramePosterior frame;
  frame.distance = 0.9;
  frame.width = 80;
  frame.pixels = 100.0;
  frame.mass_above_truth = {0.2, 0.95};
  frame.ellipsoid_mass = {0.6, 0.6};
  frame.effective_samples = {300.0, 20.0};
  FramePosterior other = frame;
  other.object = 1;
  other.width = 160;
  other.pixels = 300.0;
  other.mass_above_truth = {0.7, 0.91};
  const CredibleRegionReport report = coverage({frame, other}, {1.0, 2.0});
  const CoverageRow& all = row_of(report, "all");
  EXPECT_EQ(all.n, 2);
  EXPECT_EQ(all.pixels, 200.0);
  EXPECT_EQ(all.weights_90, (std::vector<double>{1.0, 0.0}));
  EXPECT_EQ(all.weights_50, (std::vector<double>{0.5, 0.0}));
  EXPECT_EQ(all.information_90, (std::vector<double>{1.0, 1.0}));
  EXPECT_EQ(all.information_50, (std::vector<double>{0.0, 0.0}));
  EXPECT_EQ(row_of(report, "160 px").n, 1);
  EXPECT_EQ(row_of(report, "0.9 m").n, 2);
  EXPECT_EQ(report.fewest_effective_samples, 20.0);
  EXPECT_EQ(to_json(report)["rows"][0]["weights_90"][0], 1.0);
}

TEST(CredibleRegions, DoNotDependOnTheNumberOfThreads) {
  CredibleRegionOptions options;
  options.frames = 20;
  options.widths = {80};
  options.sampling.samples = 200;
  core::ThreadPool one(1), three(3);
  const auto a = frame_posteriors(options, 8, one);
  const auto b = frame_posteriors(options, 8, three);
  ASSERT_TRUE(a.ok() && b.ok());
  ASSERT_EQ(a->size(), b->size());
  for (std::size_t i = 0; i < a->size(); ++i) EXPECT_EQ((*a)[i].mass_above_truth, (*b)[i].mass_above_truth);
}

}  // namespace
}  // namespace prescene::service
