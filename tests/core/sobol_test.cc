// SPDX-License-Identifier: Apache-2.0
#include "prescene/core/sobol.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <numeric>
#include <set>
#include <vector>

#include "prescene/core/random.h"
#include "prescene/core/sobol_directions.h"

namespace prescene::core {
namespace {

std::uint32_t unscrambled(int dimension, std::uint32_t index) {
  const auto directions = sobol_directions(dimension);
  std::uint32_t x = 0;
  for (std::size_t bit = 0; bit < 32; ++bit) x ^= (index >> bit) & 1U ? directions[bit] : 0U;
  return x;
}

// The first `bits` binary digits of each coordinate of each point of a block, by a source of points.
using Points = std::vector<std::vector<std::uint32_t>>;

Points scrambled_block(const SobolNet& net, std::uint64_t begin, std::uint64_t count) {
  Points points;
  std::vector<double> point(static_cast<std::size_t>(net.dimensions()));
  for (std::uint64_t i = begin; i < begin + count; ++i) {
    net.point(i, point);
    std::vector<std::uint32_t> digits;
    for (const double x : point) digits.push_back(static_cast<std::uint32_t>(x * 0x1p32));
    points.push_back(std::move(digits));
  }
  return points;
}

Points plain_block(int dimensions, std::uint64_t begin, std::uint64_t count) {
  Points points;
  for (std::uint64_t i = begin; i < begin + count; ++i) {
    std::vector<std::uint32_t> digits;
    for (int d = 0; d < dimensions; ++d) digits.push_back(unscrambled(d, static_cast<std::uint32_t>(i)));
    points.push_back(std::move(digits));
  }
  return points;
}

// Whether each elementary box of volume 2^(t - m) holds exactly 2^t of the 2^m points: a (t, m, s) net.
testing::AssertionResult is_net(const Points& points, int t) {
  const int m = std::countr_zero(points.size());
  const std::size_t s = points.front().size();
  std::vector<int> digits(s, 0);
  const std::function<testing::AssertionResult(std::size_t, int)> visit = [&](std::size_t d, int left) {
    if (d + 1 < s) {
      for (digits[d] = 0; digits[d] <= left; ++digits[d]) {
        if (auto result = visit(d + 1, left - digits[d]); !result) return result;
      }
      return testing::AssertionSuccess();
    }
    digits[d] = left;
    std::vector<int> counts(std::size_t{1} << (m - t), 0);
    for (const auto& point : points) {
      std::size_t box = 0;
      for (std::size_t k = 0; k < s; ++k) {
        if (digits[k] > 0) box = (box << digits[k]) | (point[k] >> (32 - digits[k]));
      }
      ++counts[box];
    }
    if (std::all_of(counts.begin(), counts.end(), [&](int c) { return c == 1 << t; }))
      return testing::AssertionSuccess();
    auto failure = testing::AssertionFailure() << "boxes of digits";
    for (const int k : digits) failure << " " << k;
    return failure << " are not equally filled";
  };
  return visit(0, m - t);
}

TEST(SobolDirections, PolynomialsArePrimitiveAndDifferent) {
  std::set<std::pair<int, std::uint32_t>> seen;
  for (int d = 1; d < kSobolTableDimensions; ++d) {
    const SobolPolynomial p = sobol_polynomial(d);
    const std::uint32_t polynomial = (1U << p.degree) | (p.inner_coefficients << 1) | 1U;
    EXPECT_TRUE(seen.emplace(p.degree, p.inner_coefficients).second) << d;
    // Primitive: the powers of x modulo the polynomial return to 1 after 2^degree - 1 steps, not before.
    std::uint32_t power = 1;
    int order = 0;
    do {
      power <<= 1;
      if ((power >> p.degree) & 1U) power ^= polynomial;
      ++order;
    } while (power != 1 && order <= 1 << p.degree);
    EXPECT_EQ(order, (1 << p.degree) - 1) << "dimension " << d;
  }
}

TEST(SobolDirections, InitialNumbersAreOddAndInRange) {
  for (int d = 1; d < kSobolTableDimensions; ++d) {
    const SobolPolynomial p = sobol_polynomial(d);
    ASSERT_EQ(p.initial.size(), static_cast<std::size_t>(p.degree));
    for (std::size_t i = 0; i < p.initial.size(); ++i) {
      EXPECT_EQ(p.initial[i] % 2, 1) << d << ", " << i;
      EXPECT_LT(p.initial[i], 2U << i) << d << ", " << i;
    }
  }
}

TEST(SobolDirections, FirstNumbersAreThePublishedOnes) {
  // Lines 3, 8 and 128 of the table of Joe and Kuo, and points worked out by hand.
  EXPECT_EQ(sobol_polynomial(2).degree, 2);
  EXPECT_EQ(sobol_polynomial(7).inner_coefficients, 2U);
  const auto last = sobol_polynomial(127);
  EXPECT_EQ(last.inner_coefficients, 242U);
  EXPECT_EQ(std::vector<int>(last.initial.begin(), last.initial.end()),
            (std::vector<int>{1, 3, 3, 7, 5, 41, 127, 61, 261, 717}));
  const std::vector<double> third_point = {0.75, 0.25, 0.25};
  for (int d = 0; d < 3; ++d) EXPECT_EQ(unscrambled(d, 3) * 0x1p-32, third_point[static_cast<std::size_t>(d)]) << d;
}

TEST(SobolDirections, EveryDimensionIsAPermutationOfStrataInEveryAlignedBlock) {
  for (int d = 0; d < kSobolTableDimensions; ++d) {
    for (const std::uint32_t begin : {0U, 256U * 77U}) {
      std::vector<bool> seen(256, false);
      for (std::uint32_t i = begin; i < begin + 256; ++i) seen[unscrambled(d, i) >> 24] = true;
      EXPECT_EQ(std::count(seen.begin(), seen.end(), true), 256) << d;
    }
  }
}

TEST(SobolDirections, LowDimensionsAreNets) {
  // The quality parameter is the sum of (degree - 1) of the polynomials [Sobol' 1967]: 0, 0, 1, 3, 5.
  EXPECT_TRUE(is_net(plain_block(2, 0, 256), 0));
  EXPECT_TRUE(is_net(plain_block(2, 3 * 256, 256), 0));
  EXPECT_TRUE(is_net(plain_block(3, 512, 512), 1));
  EXPECT_TRUE(is_net(plain_block(4, 0, 512), 3));
  EXPECT_TRUE(is_net(plain_block(5, 1024, 1024), 5));
  EXPECT_FALSE(is_net(plain_block(5, 0, 1024), 0));
}

TEST(SobolNet, ScramblingKeepsTheNets) {
  for (const std::uint64_t seed : {1ULL, 2ULL, 0xffffffffffffffffULL}) {
    EXPECT_TRUE(is_net(scrambled_block(SobolNet(2, seed), 0, 256), 0));
    EXPECT_TRUE(is_net(scrambled_block(SobolNet(2, seed), 5 * 256, 256), 0));
    EXPECT_TRUE(is_net(scrambled_block(SobolNet(3, seed), 0, 512), 1));
    EXPECT_TRUE(is_net(scrambled_block(SobolNet(4, seed), 512, 512), 3));
    EXPECT_TRUE(is_net(scrambled_block(SobolNet(5, seed), 0, 1024), 5));
  }
}

TEST(SobolNet, EveryDimensionIsAPermutationOfStrata) {
  const SobolNet net(SobolNet::kMaxDimensions, 42);
  const Points points = scrambled_block(net, 1024, 256);
  for (std::size_t d = 0; d < 128; ++d) {
    std::vector<bool> seen(256, false);
    for (const auto& point : points) seen[point[d] >> 24] = true;
    EXPECT_EQ(std::count(seen.begin(), seen.end(), true), 256) << d;
  }
}

TEST(SobolNet, PointsDependOnSeedIndexAndCoordinateOnly) {
  const SobolNet small(3, 7);
  const SobolNet large(40, 7);
  const SobolNet other(3, 8);
  std::vector<double> a(3), b(40), c(3);
  for (const std::uint64_t index : {0ULL, 1ULL, 1000ULL, 0xffffffffULL}) {
    small.point(index, a);
    large.point(index, b);
    other.point(index, c);
    EXPECT_TRUE(std::equal(a.begin(), a.end(), b.begin()));
    EXPECT_NE(a, c);
    for (const double x : b) {
      EXPECT_GT(x, 0.0);
      EXPECT_LT(x, 1.0);
    }
  }
}

TEST(SobolNet, MeansOverScramblesAreUnbiased) {
  // Over 4,000 scrambles of 8 points the mean of x y^2 (true value 1/6) must be within 4.9 standard errors (false
  // alarms: one in a million) of it, whatever the variance of one scramble's mean is.
  constexpr int kScrambles = 4000;
  double sum = 0.0;
  double squares = 0.0;
  std::vector<double> p(2);
  for (int seed = 0; seed < kScrambles; ++seed) {
    const SobolNet net(2, static_cast<std::uint64_t>(seed));
    double mean = 0.0;
    for (std::uint64_t i = 0; i < 8; ++i) {
      net.point(i, p);
      mean += p[0] * p[1] * p[1] / 8.0;
    }
    sum += mean;
    squares += mean * mean;
  }
  const double mean = sum / kScrambles;
  const double deviation = std::sqrt((squares / kScrambles - mean * mean) / kScrambles);
  EXPECT_GT(deviation, 0.0);
  EXPECT_LT(std::abs(mean - 1.0 / 6.0), 4.9 * deviation);
}

TEST(SobolNet, IntegratesBetterThanRandomPoints) {
  // The product of 6 factors of mean 1 over 4096 points: random points have a relative error of 1.1 %.
  const auto f = [](const std::vector<double>& p) {
    return std::accumulate(p.begin(), p.end(), 1.0, [](double product, double x) { return product * (0.5 + x); });
  };
  double squared_error = 0.0;
  std::vector<double> p(6);
  for (std::uint64_t seed = 0; seed < 16; ++seed) {
    const SobolNet net(6, seed);
    double mean = 0.0;
    for (std::uint64_t i = 0; i < 4096; ++i) {
      net.point(i, p);
      mean += f(p) / 4096.0;
    }
    squared_error += (mean - 1.0) * (mean - 1.0) / 16.0;
  }
  EXPECT_LT(std::sqrt(squared_error), 0.0011);
}

TEST(SobolNetDeathTest, WrongSizesAreBugs) {
  testing::FLAGS_gtest_death_test_style = "threadsafe";
  EXPECT_DEATH(SobolNet(0, 1), "dimensions");
  EXPECT_DEATH(SobolNet(129, 1), "dimensions");
  std::vector<double> p(2);
  EXPECT_DEATH(SobolNet(3, 1).point(0, p), "point.size");
  EXPECT_DEATH(SobolNet(2, 1).point(1ULL << 32, p), "index");
}

}  // namespace
}  // namespace prescene::core
