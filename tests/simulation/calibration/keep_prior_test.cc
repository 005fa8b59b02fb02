// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/calibration/keep_prior.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>

#include "prescene/geometry/dense_solvers.h"

namespace prescene::tests {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using simulation::keep_prior;

VectorXd vector(double a, double b, double c) {
  VectorXd v(3);
  v << a, b, c;
  return v;
}

TEST(KeepPrior, LeavesWhatIsTold) {
  const MatrixXd before = vector(0.04, 0.01, 0.5).asDiagonal();
  VectorXd value = vector(1.0, 2.0, 3.0);
  MatrixXd covariance = before;
  keep_prior(vector(0.0, 0.0, 0.0), vector(1.0, 1.0, 1.0), &value, &covariance);
  EXPECT_EQ(value, vector(1.0, 2.0, 3.0));
  EXPECT_EQ(covariance, before);
}

TEST(KeepPrior, GivesPriorsBackToTheBit) {
  VectorXd value = vector(1.0, 0.13, 3.0);
  MatrixXd covariance = vector(0.04, 0.0225 * 1.08, 0.99).asDiagonal();
  keep_prior(vector(0.1, 0.7, -0.3), vector(1.0, 0.15, 1.0), &value, &covariance);
  EXPECT_EQ(value, vector(1.0, 0.7, -0.3));
  EXPECT_EQ(std::sqrt(covariance(1, 1)), 0.15);
  EXPECT_EQ(std::sqrt(covariance(2, 2)), 1.0);
  EXPECT_EQ(covariance(0, 0), 0.04);
}

TEST(KeepPrior, OthersMoveAsIfItHadBeenKnown) {
  // Two measurements of sums, one of them next to nothing of b: the estimate with b at its prior's mean is the one of
  // least squares in which b is that.
  MatrixXd A(4, 3);
  A << 1.0, 0.1, 0.0, 0.0, 0.1, 1.0, 1.0, -0.1, 1.0, 0.5, 0.05, -1.0;
  const VectorXd prior_mean = vector(0.0, 0.0, 0.0);
  const VectorXd deviation = vector(10.0, 1.0, 10.0);
  const MatrixXd precision = deviation.cwiseAbs2().cwiseInverse().asDiagonal();
  Eigen::Vector4d y(1.0, 2.0, 2.5, -1.2);
  MatrixXd covariance = geometry::inverse(A.transpose() * A + precision);
  VectorXd value = covariance * A.transpose() * y;
  ASSERT_GT(std::sqrt(covariance(1, 1)), 0.9);
  const double error = std::sqrt(covariance(0, 0));
  keep_prior(prior_mean, deviation, &value, &covariance);
  EXPECT_EQ(value[1], 0.0);
  MatrixXd rest(4, 2);
  rest << A.col(0), A.col(2);
  const MatrixXd known = rest.transpose() * rest + 0.01 * MatrixXd::Identity(2, 2);
  const Eigen::Vector2d expected = geometry::inverse(known) * rest.transpose() * y;
  EXPECT_NEAR(value[0], expected[0], 1e-12);
  EXPECT_NEAR(value[2], expected[1], 1e-12);
  // Their errors still have its uncertainty in them.
  EXPECT_NEAR(std::sqrt(covariance(0, 0)), error, 1e-12);
}

}  // namespace
}  // namespace prescene::tests
