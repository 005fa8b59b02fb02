// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "prescene/belief/distribution.h"
#include "prescene/core/sobol.h"
#include "tests/belief/random_values.h"
#include "tests/support/laws.h"
#include "tests/support/matchers.h"

namespace prescene::belief {
namespace {

using core::Purpose;
using core::RandomStream;

// Mean and variance over the midpoints of n equal cells of (0, 1): the integral of the quantile function.
std::pair<double, double> quantile_moments(const ScalarDistribution& distribution, int n) {
  double sum = 0.0, squares = 0.0;
  for (int i = 0; i < n; ++i) {
    const double u = (i + 0.5) / n;
    const double x = draw(distribution, std::span(&u, static_cast<std::size_t>(dimensions(distribution))));
    sum += x;
    squares += x * x;
  }
  return {sum / n, squares / n - sum / n * (sum / n)};
}

TEST(ScalarDistributionLaws, DrawsGrowWithTheirNumberStayInRangeAndHaveTheStatedMoments) {
  EXPECT_TRUE(tests::check_law([](std::uint64_t seed) {
    RandomStream stream(seed, Purpose::kTest);
    const ScalarDistribution distribution = tests::random_scalar(stream);
    const bool ordered = !std::holds_alternative<SampledScalar>(distribution);
    double last = -std::numeric_limits<double>::infinity();
    for (int i = 0; i < 100; ++i) {
      const double u = (i + 0.5) / 100;
      const double x = draw(distribution, std::span(&u, static_cast<std::size_t>(dimensions(distribution))));
      RC_ASSERT(x >= lowest(distribution) && x <= highest(distribution));
      if (ordered) RC_ASSERT(x >= last);
      last = x;
    }
    const auto [m, v] = quantile_moments(distribution, 4000);
    RC_ASSERT(std::abs(m - mean(distribution)) < 1e-4);
    RC_ASSERT(std::abs(v - variance(distribution)) < 2e-3 * std::max(0.01, variance(distribution)));
  }));
}

TEST(ScalarDistribution, OfOneValueTakesNoNumbers) {
  for (const ScalarDistribution& distribution :
       {ScalarDistribution(FixedScalar{0.3}), ScalarDistribution(NormalScalar{0.3, 0.0}),
        ScalarDistribution(UniformScalar{0.3, 0.3}), ScalarDistribution(SampledScalar{{0.3}})}) {
    EXPECT_EQ(dimensions(distribution), 0);
    EXPECT_EQ(draw(distribution, {}), 0.3);
    EXPECT_EQ(mean(distribution), 0.3);
    EXPECT_EQ(variance(distribution), 0.0);
  }
}

TEST(ScalarDistribution, CutFarOutInATailStaysThereWithoutLosingItsShape) {
  // Beyond 8 deviations the tail falls like exp(-8 (x - 8)): the mean excess is about 1/8.
  for (const double side : {1.0, -1.0}) {
    NormalScalar tail{0.0, 1.0};
    (side > 0.0 ? tail.low : tail.high) = side * 8.0;
    const double excess = side * mean(tail) - 8.0;
    EXPECT_NEAR(excess, 0.1214, 5e-4) << side;  // Mills ratio: phi(8)/Q(8) - 8
    const auto [m, v] = quantile_moments(tail, 4000);
    EXPECT_NEAR(side * m - 8.0, excess, 2e-4);
    EXPECT_NEAR(v, variance(tail), 2e-4);
  }
  const NormalScalar nothing_left{0.0, 1.0, 60.0, 61.0};
  const double u = 0.3;
  EXPECT_GE(draw(nothing_left, std::span(&u, 1)), 60.0);
  EXPECT_LE(draw(nothing_left, std::span(&u, 1)), 61.0);
  EXPECT_GE(mean(nothing_left), 60.0);
}

TEST(CovarianceSquareRootLaws, ItsSquareIsTheCovarianceAndItsColumnsAreTheRankWidestFirst) {
  EXPECT_TRUE(tests::check_law([](std::uint64_t seed) {
    RandomStream stream(seed, Purpose::kTest);
    const int size = 1 + tests::random_below(stream, 12);
    const int rank = tests::random_below(stream, size + 1);
    const Eigen::MatrixXd covariance = tests::random_covariance(stream, size, rank);
    const Eigen::MatrixXd root = covariance_square_root(covariance);
    RC_ASSERT(root.cols() <= rank);
    // A product of random factors can come close to a lower rank, but not beyond what the cut allows.
    RC_ASSERT((root * root.transpose() - covariance).norm() <= 1e-12 * std::max(covariance.norm(), 1e-300));
    for (Eigen::Index i = 1; i < root.cols(); ++i)
      RC_ASSERT(root.col(i).norm() <= root.col(i - 1).norm() * (1.0 + 1e-9));
  }));
}

TEST(PoseDistributionLaws, ANormalPoseIsTheErrorMapOfStandardNormals) {
  EXPECT_TRUE(tests::check_law([](std::uint64_t seed) {
    RandomStream stream(seed, Purpose::kTest);
    const Pose X_mean = tests::random_pose(stream);
    const NormalPose normal{X_mean, tests::random_covariance(stream, 6, 6)};
    const Eigen::MatrixXd root = covariance_square_root(normal.covariance);
    RC_ASSERT(dimensions(PoseDistribution(normal)) == root.cols());
    std::vector<double> u(static_cast<std::size_t>(root.cols()));
    Eigen::VectorXd z(root.cols());
    for (std::size_t i = 0; i < u.size(); ++i) {
      u[i] = stream.uniform();
      z[static_cast<Eigen::Index>(i)] = core::inverse_normal_cdf(u[i]);
    }
    const Vector6d d = geometry::box_minus(draw(PoseDistribution(normal), u), X_mean);
    RC_ASSERT((d - root * z).norm() < 1e-9);
  }));
}

TEST(PoseDistributionLaws, SobolDrawsHaveTheStatedMeanAndCovariance) {
  EXPECT_TRUE(tests::check_law([](std::uint64_t seed) {
    RandomStream stream(seed, Purpose::kTest);
    PoseDistribution distribution = tests::random_pose_distribution(stream);
    if (auto* box = std::get_if<BoxPose>(&distribution)) box->any_rotation = false;
    // Spread samples have no mean rotation worth the name.
    if (const auto* sampled = std::get_if<SampledPose>(&distribution)) RC_PRE(sampled->samples.size() == 1U);
    const int count = dimensions(distribution);
    const Pose X_mean = mean(distribution);
    constexpr int kDraws = 1024;
    const core::SobolNet net(std::max(count, 1), seed);
    std::vector<double> u(static_cast<std::size_t>(net.dimensions()));
    Vector6d sum = Vector6d::Zero();
    Matrix6d squares = Matrix6d::Zero();
    for (int i = 0; i < kDraws; ++i) {
      net.point(static_cast<std::uint64_t>(i), u);
      const Pose X_WO = draw(distribution, std::span(u).first(static_cast<std::size_t>(count)));
      RC_ASSERT(std::abs(X_WO.rotation.norm() - 1.0) < 1e-9);
      const Vector6d d = geometry::box_minus(X_WO, X_mean);
      sum += d;
      squares += d * d.transpose();
    }
    RC_ASSERT((sum / kDraws).norm() < 5e-3);
    RC_ASSERT((squares / kDraws - covariance(distribution)).cwiseAbs().maxCoeff() < 5e-3);
  }));
}

TEST(PoseDistribution, AnyRotationHasTheRotationVectorCovarianceOfTheUniformOne) {
  BoxPose box;
  box.position = Vector3Distribution::fixed(Vector3d(0.1, 0.2, 0.3));
  box.any_rotation = true;
  const core::SobolNet net(3, 7);
  std::array<double, 3> u{};
  Matrix6d squares = Matrix6d::Zero();
  constexpr int kDraws = 1 << 14;
  for (int i = 0; i < kDraws; ++i) {
    net.point(static_cast<std::uint64_t>(i), u);
    const Vector6d d = geometry::box_minus(draw(PoseDistribution(box), u), mean(PoseDistribution(box)));
    squares += d * d.transpose();
  }
  EXPECT_THAT(Matrix6d(squares / kDraws), tests::is_near(covariance(PoseDistribution(box)), 0.01));
}

TEST(PoseDistribution, TheMeanOfSamplesIsTheMiddleRotationAtTheMeanPosition) {
  const auto about_z = [](double angle, double x) {
    return Pose{geometry::exp_rotation({0.0, 0.0, angle}), Vector3d(x, 0.0, 0.0)};
  };
  const SampledPose sampled{{about_z(0.0, 1.0), about_z(0.3, 2.0), about_z(2.0, 6.0)}};
  const Pose middle = mean(PoseDistribution(sampled));
  EXPECT_THAT(middle, tests::is_near(about_z(0.3, 3.0), 1e-12, 1e-12));
}

}  // namespace
}  // namespace prescene::belief
