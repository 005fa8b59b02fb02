// SPDX-License-Identifier: Apache-2.0
// Each test has a false-alarm rate of one in a million for a perfect generator, were the seed drawn anew.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "prescene/core/random.h"

namespace prescene::core {
namespace {

constexpr double kFalseAlarm = 1e-6;

// Upper quantile of chi squared [Wilson & Hilferty 1931].
double chi_squared_bound(double degrees) {
  const double z = inverse_normal_cdf(1.0 - kFalseAlarm);
  const double a = 2.0 / (9.0 * degrees);
  return degrees * std::pow(1.0 - a + z * std::sqrt(a), 3);
}

double chi_squared(const std::vector<double>& counts, double expected) {
  double sum = 0.0;
  for (const double count : counts) sum += (count - expected) * (count - expected) / expected;
  return sum;
}

// Bound of a standard normal figure, both sides.
const double kNormalBound = inverse_normal_cdf(1.0 - 0.5 * kFalseAlarm);

// Kolmogorov's bound of sqrt(n) times the largest distance of two distribution functions: 2 exp(-2 x^2) = false alarm.
const double kKolmogorovBound = std::sqrt(0.5 * std::log(2.0 / kFalseAlarm));

double kolmogorov_distance(std::vector<double> uniforms) {
  std::sort(uniforms.begin(), uniforms.end());
  const auto n = static_cast<double>(uniforms.size());
  double worst = 0.0;
  for (std::size_t i = 0; i < uniforms.size(); ++i) {
    const auto k = static_cast<double>(i);
    worst = std::max({worst, uniforms[i] - k / n, (k + 1.0) / n - uniforms[i]});
  }
  return worst;
}

TEST(RandomStatistics, EachByteIsUniform) {
  RandomStream stream(11, Purpose::kTest);
  constexpr int kDraws = 1 << 18;
  std::vector<std::vector<double>> counts(8, std::vector<double>(256, 0.0));
  for (int i = 0; i < kDraws; ++i) {
    const std::uint64_t word = stream.next_u64();
    for (std::size_t b = 0; b < 8; ++b) ++counts[b][(word >> (8 * b)) & 255];
  }
  for (const auto& bins : counts) EXPECT_LT(chi_squared(bins, kDraws / 256.0), chi_squared_bound(255));
}

TEST(RandomStatistics, UniformsAreUniformAndOpen) {
  RandomStream stream(12, Purpose::kTest);
  std::vector<double> values(200000);
  for (double& x : values) {
    x = stream.uniform();
    ASSERT_GT(x, 0.0);
    ASSERT_LT(x, 1.0);
  }
  EXPECT_LT(kolmogorov_distance(values) * std::sqrt(200000.0), kKolmogorovBound);
}

TEST(RandomStatistics, NormalsAreNormal) {
  RandomStream stream(13, Purpose::kTest);
  std::vector<double> values(200000);
  for (double& x : values) x = normal_cdf(stream.normal(2.0, 0.5) * 2.0 - 4.0);
  EXPECT_LT(kolmogorov_distance(values) * std::sqrt(200000.0), kKolmogorovBound);
}

TEST(RandomStatistics, StreamsOfNeighboursAreIndependent) {
  // The mean product of n pairs of independent standard normals has the standard deviation 1 / sqrt(n).
  constexpr int kPairs = 100000;
  const RandomStream base(14, Purpose::kTest);
  const auto correlation = [&](auto&& partner) {
    double sum = 0.0;
    for (int i = 0; i < kPairs; ++i) {
      const auto particle = static_cast<std::uint32_t>(i);
      RandomStream a = base.at(5, particle);
      RandomStream b = partner(particle);
      sum += a.normal() * b.normal();
    }
    return sum / std::sqrt(kPairs);
  };
  EXPECT_LT(std::abs(correlation([&](std::uint32_t p) { return base.at(5, p + 1); })), kNormalBound);
  EXPECT_LT(std::abs(correlation([&](std::uint32_t p) { return base.at(6, p); })), kNormalBound);
  EXPECT_LT(std::abs(correlation([&](std::uint32_t p) { return RandomStream(15, Purpose::kTest, 5, p); })),
            kNormalBound);
  EXPECT_LT(std::abs(correlation([&](std::uint32_t p) { return base.at(5, p).for_purpose(Purpose::kStartBelief); })),
            kNormalBound);
}

TEST(RandomStatistics, UniformBelowHasNoBiasForLargeBounds) {
  // Taking the high part of a product without rejection would give the first third of these 1.5 * 2^63 values twice as
  // often as the others.
  constexpr std::uint64_t kBound = 3ULL << 62;
  RandomStream stream(16, Purpose::kTest);
  std::vector<double> thirds(3, 0.0);
  constexpr int kDraws = 90000;
  for (int i = 0; i < kDraws; ++i) ++thirds[stream.uniform_below(kBound) % 3];
  EXPECT_LT(chi_squared(thirds, kDraws / 3.0), chi_squared_bound(2));
  std::vector<double> parts(3, 0.0);
  for (int i = 0; i < kDraws; ++i) ++parts[stream.uniform_below(kBound) >> 62];
  EXPECT_LT(chi_squared(parts, kDraws / 3.0), chi_squared_bound(2));
}

TEST(RandomStatistics, AllOrdersOfAShuffleAreEquallyLikely) {
  RandomStream stream(17, Purpose::kTest);
  std::map<std::string, double> orders;
  constexpr int kShuffles = 48000;
  for (int i = 0; i < kShuffles; ++i) {
    std::string text = "abcd";
    stream.shuffle(std::span(text.data(), text.size()));
    ++orders[text];
  }
  ASSERT_EQ(orders.size(), 24U);
  std::vector<double> counts;
  for (const auto& [text, count] : orders) counts.push_back(count);
  EXPECT_LT(chi_squared(counts, kShuffles / 24.0), chi_squared_bound(23));
}

}  // namespace
}  // namespace prescene::core
