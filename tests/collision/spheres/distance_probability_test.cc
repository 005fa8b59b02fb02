// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/spheres/distance_probability.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <vector>

#include "prescene/core/random.h"
#include "tests/support/allocations.h"

namespace prescene::collision::distance_probability_test {
namespace {

using core::RandomStream;
using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Gauss-Legendre nodes and weights on [-1, 1], by Newton's iteration.
struct Rule {
  explicit Rule(int n) : nodes(static_cast<std::size_t>(n)), weights(static_cast<std::size_t>(n)) {
    for (int i = 0; i < n; ++i) {
      double x = std::cos(std::numbers::pi * (i + 0.75) / (n + 0.5));
      double slope = 1.0;
      for (int k = 0; k < 100; ++k) {
        double before = 1.0;
        double value = x;
        for (int j = 2; j <= n; ++j) {
          const double next = ((2 * j - 1) * x * value - (j - 1) * before) / j;
          before = value;
          value = next;
        }
        slope = n * (x * value - before) / (x * x - 1.0);
        const double step = value / slope;
        x -= step;
        if (std::abs(step) < 1e-15) break;
      }
      nodes[static_cast<std::size_t>(i)] = x;
      weights[static_cast<std::size_t>(i)] = 2.0 / ((1.0 - x * x) * slope * slope);
    }
  }
  template <class F>
  double integrate(double low, double high, int panels, F f) const {
    double sum = 0.0;
    const double width = (high - low) / panels;
    for (int p = 0; p < panels; ++p) {
      for (std::size_t i = 0; i < nodes.size(); ++i)
        sum += 0.5 * width * weights[i] * f(low + width * (p + 0.5 + 0.5 * nodes[i]));
    }
    return sum;
  }
  std::vector<double> nodes;
  std::vector<double> weights;
};

double interval(double mean, double deviation, double half) {
  return core::normal_cdf((half - std::abs(mean)) / deviation) - core::normal_cdf((-half - std::abs(mean)) / deviation);
}

/// The probability by brute force: two nested integrals over the directions of least deviation, the third in closed
/// form. Deviations ascending, all positive.
double reference(const Vector3d& mean, const Vector3d& deviation, double radius, const Rule& rule, int panels = 6) {
  const auto slice = [&](int axis, double half, auto&& inside) {
    const double low = std::max(-half, mean[axis] - 9.0 * deviation[axis]);
    const double high = std::min(half, mean[axis] + 9.0 * deviation[axis]);
    if (low >= high) return 0.0;
    return rule.integrate(std::asin(low / half), std::asin(high / half), panels, [&](double t) {
      const double x = half * std::sin(t);
      const double z = (x - mean[axis]) / deviation[axis];
      const double density = std::exp(-0.5 * z * z) / (deviation[axis] * std::sqrt(2.0 * std::numbers::pi));
      return half * std::cos(t) * density * inside(std::sqrt(std::max(0.0, half * half - x * x)));
    });
  };
  return slice(0, radius, [&](double rest) {
    return rest > 0.0 ? slice(1, rest, [&](double last) { return interval(mean[2], deviation[2], last); }) : 0.0;
  });
}

Matrix3d random_rotation(RandomStream& stream) {
  const double z = stream.normal(), y = stream.normal(), x = stream.normal(), w = stream.normal();
  return Eigen::Quaterniond(w, x, y, z).normalized().toRotationMatrix();
}

struct Case {
  Vector3d mean;  // In the axes of the covariance.
  Vector3d deviation;
  double radius;
};

/// Deviations over three and a half decades about the radius, also of very different size; the mean about the rim.
Case random_case(RandomStream& stream) {
  Case c;
  c.radius = std::pow(10.0, stream.uniform(-4.0, 2.0));
  const double scale = std::pow(10.0, stream.uniform(-2.0, 1.5));
  for (int i = 0; i < 3; ++i) {
    const double kind = stream.uniform();
    const double share = kind < 0.2   ? 1e-5
                         : kind < 0.5 ? std::pow(10.0, stream.uniform(-2.0, 0.0))
                                      : stream.uniform(0.001, 1.0);
    c.deviation[i] = scale * share;
  }
  std::sort(c.deviation.begin(), c.deviation.end());
  const double distance =
      stream.uniform() < 0.5 ? std::abs(1.0 + stream.uniform(-4.0, 4.0) * c.deviation[2]) : stream.uniform(0.0, 3.0);
  const double along_z = stream.normal(), along_y = stream.normal(), along_x = stream.normal();
  Vector3d direction = Vector3d(along_x, along_y, along_z).normalized();
  if (stream.uniform() < 0.4) direction = Vector3d::Unit(static_cast<int>(stream.uniform_below(3)));
  c.mean = c.radius * distance * direction;
  c.deviation *= c.radius;
  return c;
}

TEST(DistanceProbability, AgreesWithNestedIntegralsAndBoundsHold) {
  const Rule rule(16);
  RandomStream stream(1, core::Purpose::kTest);
  double worst = 0.0;
  double gap = 0.0;
  constexpr int kCases = 4000;
  for (int i = 0; i < kCases; ++i) {
    const Case c = random_case(stream);
    const Matrix3d R = random_rotation(stream);
    const Vector3d mean = R * c.mean;
    const Matrix3d covariance = R * c.deviation.cwiseAbs2().asDiagonal() * R.transpose();
    const double found = distance_probability(mean, covariance, c.radius);
    double expected = reference(c.mean, c.deviation, c.radius, rule);
    // Where the ball's rim is steep in the inner variable, the integrals need finer steps.
    if (std::abs(found - expected) > 2e-4) expected = reference(c.mean, c.deviation, c.radius, rule, 100);
    worst = std::max(worst, std::abs(found - expected));
    ASSERT_NEAR(found, expected, kDistanceProbabilityError)
        << c.mean.transpose() << " | " << c.deviation.transpose() << " | " << c.radius;
    const ProbabilityBounds bounds = distance_probability_bounds(mean, covariance, c.radius);
    ASSERT_LE(bounds.lower, expected + 1e-6);
    ASSERT_GE(bounds.upper, expected - 1e-6);
    gap += (bounds.upper - bounds.lower) / kCases;
  }
  std::printf("largest error %.1e of %d cases, mean width of the bounds %.3f\n", worst, kCases, gap);
}

TEST(DistanceProbability, AgreesWithDraws) {
  RandomStream stream(2, core::Purpose::kTest);
  constexpr int kDraws = 1'000'000;
  for (int i = 0; i < 4; ++i) {
    Case c = random_case(stream);
    c.deviation = c.radius * Vector3d(0.1, 0.4, 0.9);
    c.mean = c.radius * Vector3d(0.3, -0.5 * i, 0.4);
    const Matrix3d R = random_rotation(stream);
    int inside = 0;
    for (int k = 0; k < kDraws; ++k) {
      const double along_z = stream.normal(), along_y = stream.normal(), along_x = stream.normal();
      const Vector3d z(along_x, along_y, along_z);
      if ((c.mean + c.deviation.cwiseProduct(z)).norm() <= c.radius) ++inside;
    }
    const double share = static_cast<double>(inside) / kDraws;
    const double noise = 3.0 * std::sqrt(share * (1.0 - share) / kDraws);
    const Matrix3d covariance = R * c.deviation.cwiseAbs2().asDiagonal() * R.transpose();
    EXPECT_NEAR(distance_probability(R * c.mean, covariance, c.radius), share, noise + kDistanceProbabilityError);
  }
}

TEST(DistanceProbability, IsotropicFormAgreesWithNestedIntegrals) {
  const Rule rule(16);
  for (const double deviation : {0.02, 0.3, 1.0, 8.0}) {
    for (const double distance : {0.0, 1e-7, 1e-5, 2e-4, 0.01, 0.5, 0.9, 1.0, 1.1, 2.0}) {
      const double expected = reference(Vector3d(0, 0, distance), Vector3d::Constant(deviation), 1.0, rule);
      EXPECT_NEAR(isotropic_distance_probability(distance, deviation, 1.0), expected, 2e-9)
          << deviation << " " << distance;
      EXPECT_NEAR(distance_probability(Vector3d(distance, 0, 0), deviation * deviation * Matrix3d::Identity(), 1.0),
                  expected, 1e-6);
    }
  }
}

TEST(DistanceProbability, KnowsDegenerateCovariances) {
  const Matrix3d zero = Matrix3d::Zero();
  EXPECT_EQ(distance_probability(Vector3d(0, 0, 2), zero, 2.0), 1.0);
  EXPECT_EQ(distance_probability(Vector3d(0, 0, 2.001), zero, 2.0), 0.0);
  EXPECT_EQ(distance_probability(Vector3d::Zero(), zero, 0.0), 1.0);
  EXPECT_EQ(distance_probability(Vector3d::Zero(), Matrix3d::Identity(), 0.0), 0.0);
  EXPECT_EQ(distance_probability(Vector3d::Zero(), Matrix3d::Identity(), -1.0), 0.0);
  EXPECT_EQ(isotropic_distance_probability(1.0, 0.0, 1.0), 1.0);

  // Rank one: along the line, only the part of the ball that the line passes counts.
  const Matrix3d line = Vector3d(0.25, 0, 0).asDiagonal();
  for (const double across : {0.0, 0.6, 0.8, 0.99}) {
    const double half = std::sqrt(1.0 - across * across);
    EXPECT_NEAR(distance_probability(Vector3d(0.7, across, 0), line, 1.0), interval(0.7, 0.5, half),
                kDistanceProbabilityError);
  }
  EXPECT_NEAR(distance_probability(Vector3d(0.7, 1.02, 0), line, 1.0), 0.0, kDistanceProbabilityError);
  // Rank two, centred: exp(-r^2 / 2).
  const Matrix3d plane = Vector3d(0.25, 0.25, 0).asDiagonal();
  EXPECT_NEAR(distance_probability(Vector3d(0, 0, 0.6), plane, 1.0), 1.0 - std::exp(-0.5 * 0.64 / 0.25),
              kDistanceProbabilityError);
}

TEST(DistanceProbability, JointTailHasItsKnownValues) {
  const Rule rule(20);
  EXPECT_NEAR(joint_upper_tail(0, 0, 0.5), 1.0 / 3.0, 1e-9);
  EXPECT_NEAR(joint_upper_tail(0, 0, -1.0), 0.0, 1e-6);
  for (const double rho : {-0.9999, -0.95, -0.3, 0.2, 0.9, 0.99, 0.9999}) {
    for (const double h : {-2.0, -0.1, 0.5, 3.0}) {
      for (const double k : {-1.0, 0.49, 2.9}) {
        const double rest = std::sqrt(1.0 - rho * rho);
        const double expected = rule.integrate(std::max(h, -9.0), 9.0, 400, [&](double x) {
          return std::exp(-0.5 * x * x) / std::sqrt(2.0 * std::numbers::pi) * core::normal_cdf((rho * x - k) / rest);
        });
        EXPECT_NEAR(joint_upper_tail(h, k, rho), expected, 1e-6) << h << " " << k << " " << rho;
      }
    }
  }
  EXPECT_NEAR(joint_upper_tail(0.4, 0.7, 1.0), core::normal_cdf(-0.7), 1e-6);
}

TEST(DistanceProbability, RadiiInvertTheirTails) {
  for (const double p : {1e-9, 1e-6, 0.003, 0.3, 0.999}) {
    EXPECT_NEAR(six_dimensional_tail(six_dimensional_radius(p)) / p, 1.0, 1e-9);
    EXPECT_NEAR(isotropic_distance_probability(0.0, 1.0, three_dimensional_radius(p)), 1.0 - p, 1e-12 + 1e-9 * p);
  }
  EXPECT_EQ(six_dimensional_radius(1.0), 0.0);
  EXPECT_EQ(six_dimensional_tail(0.0), 1.0);
}

TEST(DistanceProbability, DoesNotAllocate) {
  if (!tests::can_count_allocations()) GTEST_SKIP() << "allocations are not counted in this build";
  const Matrix3d covariance = Vector3d(0.1, 0.2, 0.3).asDiagonal();
  const auto before = tests::allocation_count();
  const double sum = distance_probability(Vector3d(1, 0, 1), covariance, 1.0) +
                     distance_probability_bounds(Vector3d(1, 0, 1), covariance, 1.0).upper;
  EXPECT_EQ(tests::allocation_count(), before);
  EXPECT_GT(sum, 0.0);
}

}  // namespace
}  // namespace prescene::collision::distance_probability_test
