// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/operators/resample.h"

#include <gtest/gtest.h>

#include <cmath>

namespace prescene::filter_tests {
namespace {

using belief::Particle;

std::vector<Particle> weighted(const std::vector<double>& weights) {
  std::vector<Particle> particles;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    Particle particle;
    particle.log_weight = std::log(weights[i]);
    particle.X_WO.translation.x() = static_cast<double>(i);
    particle.covariance = 1e-4 * belief::Matrix12d::Identity();
    particles.push_back(particle);
  }
  return particles;
}

TEST(SystematicIndices, CountsAreTheExpectedOnesRoundedUpOrDown) {
  const auto particles = weighted({0.05, 0.32, 0.0, 0.33, 0.30});
  for (const double u : {0.001, 0.25, 0.5, 0.999}) {
    const std::vector<int> chosen = filter::systematic_indices(particles, u);
    ASSERT_EQ(chosen.size(), 5u);
    for (int i = 0; i < 5; ++i) {
      const double expected = 5.0 * std::exp(particles[static_cast<std::size_t>(i)].log_weight);
      const auto count = static_cast<double>(std::count(chosen.begin(), chosen.end(), i));
      EXPECT_GE(count, std::floor(expected)) << i << " at " << u;
      EXPECT_LE(count, std::ceil(expected)) << i << " at " << u;
    }
  }
}

TEST(Resample, LeavesEvenWeightsAlone) {
  auto particles = weighted({0.2, 0.3, 0.25, 0.25});
  const auto before = particles;
  EXPECT_FALSE(filter::resample({}, {1, core::Purpose::kResample}, particles));
  EXPECT_EQ(particles, before);
}

TEST(Resample, KeepsTheBestUnmovedAndMakesWeightsEqual) {
  auto particles = weighted({0.01, 0.90, 0.04, 0.05});
  ASSERT_TRUE(filter::resample({}, {1, core::Purpose::kResample}, particles));
  ASSERT_EQ(particles.size(), 4u);
  EXPECT_EQ(particles[0].X_WO.translation.x(), 1.0);
  EXPECT_EQ(particles[0].covariance, 1e-4 * belief::Matrix12d::Identity());
  for (const Particle& particle : particles) EXPECT_NEAR(particle.log_weight, std::log(0.25), 1e-12);
}

TEST(Resample, WhatRestsTakesTheNegligibleBack) {
  auto particles = weighted({0.3, 0.35, 1e-9, 0.35, 1e-3});
  belief::normalize(particles);
  particles[1].mode = belief::MotionMode::kResting;
  particles[1].log_weight += 1e-3;  // the best
  belief::normalize(particles);
  const auto before = particles;
  EXPECT_FALSE(filter::resample({}, {1, core::Purpose::kResample}, particles));
  EXPECT_EQ(particles[2].X_WO, before[1].X_WO);
  EXPECT_EQ(particles[2].mode, belief::MotionMode::kResting);
  // Nothing that may be right changes.
  for (const std::size_t i : {0u, 3u, 4u}) {
    EXPECT_EQ(particles[i].X_WO, before[i].X_WO);
    EXPECT_NEAR(particles[i].log_weight, before[i].log_weight, 1e-6);
  }
  EXPECT_NEAR(std::exp(particles[1].log_weight) + std::exp(particles[2].log_weight), std::exp(before[1].log_weight),
              1e-6);
}

TEST(Resample, CopiesOfWhatRestsStayAlike) {
  auto particles = weighted({0.01, 0.90, 0.04, 0.05});
  for (Particle& particle : particles) particle.mode = belief::MotionMode::kResting;
  ASSERT_TRUE(filter::resample({}, {1, core::Purpose::kResample}, particles));
  for (const Particle& particle : particles) EXPECT_EQ(particle.X_WO.translation.x(), 1.0);
}

// Mean and variance of many copies of one Gaussian, spread: within five standard errors.
TEST(ResampleStatistics, SpreadCopiesKeepTheMoments) {
  std::vector<double> weights(2000, 1e-12);
  weights[0] = 1.0;
  auto particles = weighted(weights);
  const double variance = 1e-4;
  filter::ResampleOptions options;
  options.spread = 0.4;
  ASSERT_TRUE(filter::resample(options, {5, core::Purpose::kResample}, particles));
  double mean = 0.0, moved = 0.0;
  for (std::size_t i = 1; i < particles.size(); ++i) mean += particles[i].X_WO.translation.x() / 1999.0;
  for (std::size_t i = 1; i < particles.size(); ++i)
    moved += std::pow(particles[i].X_WO.translation.x() - mean, 2) / 1999.0;
  EXPECT_NEAR(mean, 0.0, 5.0 * std::sqrt(0.4 * variance / 1999.0));
  EXPECT_NEAR(moved + particles[1].covariance(3, 3), variance, 5.0 * std::sqrt(2.0 / 1999.0) * 0.4 * variance);
}

TEST(Resample, OneParticleOrNoneIsLeftAlone) {
  std::vector<Particle> none;
  EXPECT_FALSE(filter::resample({}, {1, core::Purpose::kResample}, none));
  auto one = weighted({1.0});
  EXPECT_FALSE(filter::resample({}, {1, core::Purpose::kResample}, one));
}

}  // namespace
}  // namespace prescene::filter_tests
