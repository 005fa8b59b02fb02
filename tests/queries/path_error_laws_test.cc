// SPDX-License-Identifier: Apache-2.0
#include "prescene/queries/path_error.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <numbers>
#include <vector>

#include "prescene/core/random.h"
#include "prescene/geometry/dense_solvers.h"

namespace prescene::queries {
namespace {

using geometry::Pose;
using geometry::Vector3d;

const geometry::SymmetryGroup kNoSymmetry = geometry::SymmetryGroup::none();

FramePeak peak_at(const Vector3d& p, double log_peak = 0.0) {
  FramePeak peak;
  peak.seen = true;
  peak.X_WO = Pose::from_translation(p);
  peak.covariance = 1e-4 * geometry::Matrix6d::Identity();
  peak.log_peak = log_peak;
  return peak;
}

TEST(PathError, WithoutErrorIsTheProductOfTheFrames) {
  PathError error(0.0, 0.05, Vector3d::UnitZ(), kNoSymmetry);
  double sum = 0.0;
  for (int k = 0; k < 4; ++k) {
    const Vector3d p(0.1 * k, 0.0, 0.0);
    error.move_to(Pose::from_translation(p));
    const FramePeak peak = peak_at(p + Vector3d(0.0, 0.01, 0.0), 3.0);
    const PathFit fit = error.fit(peak);
    EXPECT_NEAR(fit.mahalanobis, 1.0, 1e-9);
    sum += fit.log_likelihood;
    error.learn(peak);
  }
  EXPECT_NEAR(sum, 4.0 * (3.0 - 0.5), 1e-9);
  EXPECT_EQ(error.covariance().norm(), 0.0);
}

// The second method: the frames' offsets along one axis are jointly normal, with the covariance of a random walk plus
// that of the frames; the other axis of the plane and turns about the vertical only add their determinants.
TEST(PathError, HasTheLikelihoodOfTheJointDistributionOfAllFrames) {
  core::RandomStream random(5, core::Purpose::kTest);
  const double share = 0.2, noise = 1e-4;
  constexpr int kFrames = 6;
  PathError error(share, 0.05, Vector3d::UnitZ(), kNoSymmetry);
  Eigen::VectorXd off(kFrames), reached(kFrames);
  double at = 0.0, variance = 0.0, sum = 0.0;
  for (int k = 0; k < kFrames; ++k) {
    const double step = k == 0 ? 0.0 : random.uniform(0.0, 0.1);
    at += step;
    variance += share * share * step * step;
    reached[k] = variance;
    off[k] = 0.01 * random.normal();
    error.move_to(Pose::from_translation({at, 0.0, 0.0}));
    const FramePeak peak = peak_at({at + off[k], 0.0, 0.0});
    sum += error.fit(peak).log_likelihood;
    error.learn(peak);
  }
  double expected = 0.0;
  for (const double lever : {1.0, 1.0 / 0.05}) {  // translations, and turns
    Eigen::MatrixXd joint(kFrames, kFrames);
    for (int i = 0; i < kFrames; ++i)
      for (int j = 0; j < kFrames; ++j) joint(i, j) = lever * lever * reached[std::min(i, j)] + (i == j ? noise : 0.0);
    const double axes = lever == 1.0 ? 2.0 : 1.0;
    const Eigen::MatrixXd root = geometry::cholesky_factor(joint);
    expected += axes * (0.5 * kFrames * std::log(noise) - root.diagonal().array().log().sum());
    if (lever == 1.0) expected -= 0.5 * geometry::solve_lower(root, off).squaredNorm();
  }
  EXPECT_NEAR(sum, expected, 1e-6 * std::abs(expected));
}

TEST(PathError, StaysAsLongAsNothingMovesAndIsLearntFromFrames) {
  PathError error(0.5, 0.05, Vector3d::UnitZ(), kNoSymmetry);
  error.move_to(Pose{});
  const Pose X_WO = Pose::from_translation({0.2, 0.0, 0.0});
  error.move_to(X_WO);
  EXPECT_NEAR(std::sqrt(error.covariance()(3, 3)), 0.1, 1e-12);
  for (int k = 0; k < 50; ++k) {
    error.learn(peak_at({0.25, 0.0, 0.0}));
    error.move_to(X_WO);
  }
  EXPECT_NEAR(error.mean()[3], 0.05, 1e-4);
  EXPECT_NEAR(std::sqrt(error.covariance()(3, 3)), 0.01 / std::sqrt(50.0), 1e-5);
}

// Of a velocity, the error after a time is that of the way.
TEST(PathError, OfVelocitiesIsThatOfTheWayThatTheyLeadOn) {
  PathError error(0.18, 0.05, Vector3d::UnitZ(), kNoSymmetry);
  const Vector3d v(0.3, -0.2, -1.5), w(2.0, 0.0, 0.5);
  const double dt = 1e-3;
  error.move_to(Pose{});
  error.move_to(Pose{geometry::exp_rotation(dt * w), dt * v});
  EXPECT_NEAR((error.covariance() - dt * dt * error.growth(v, w)).norm(), 0.0, 1e-9 * error.covariance().norm());
}

TEST(PathError, TurnsThatChangeNothingDoNotCount) {
  const auto symmetry = geometry::SymmetryGroup::continuous(Vector3d::UnitZ(), true);
  FramePeak peak = peak_at({0.0, 0.0, 0.0});
  peak.covariance(2, 2) = 100.0;
  PathError upright(0.1, 0.05, Vector3d::UnitZ(), symmetry), turned(0.1, 0.05, Vector3d::UnitZ(), symmetry);
  upright.move_to(Pose{});
  Pose X_WO;
  X_WO.rotation = geometry::exp_rotation({std::numbers::pi, 0.0, 0.0}) * geometry::exp_rotation({0.0, 0.0, 1.0});
  turned.move_to(X_WO);
  EXPECT_NEAR(upright.fit(peak).log_likelihood, turned.fit(peak).log_likelihood, 1e-9);
}

// Two measurements of one height: the frame's, and that of what it rests on.
TEST(PathError, OfWhatIsPutDownRestsOnWhatIsBelow) {
  FramePeak peak = peak_at({0.1, 0.2, 0.5});
  PathError in_the_air(0.0, 0.05, Vector3d::UnitZ(), kNoSymmetry);
  in_the_air.put_at(peak, true);
  EXPECT_NEAR(in_the_air.pose().translation.z(), 0.5, 1e-12);  // nothing is known to be below
  peak.lift = 0.02;
  in_the_air.put_at(peak, false);
  EXPECT_NEAR(in_the_air.pose().translation.z(), 0.5, 1e-12);
  PathError error(0.0, 0.05, Vector3d::UnitZ(), kNoSymmetry);
  error.put_at(peak, true);
  const double frame = 1e-4, rest = kRestHeight * kRestHeight, all = frame + rest;
  EXPECT_NEAR(error.pose().translation.z(), (0.5 * rest + 0.48 * frame) / all, 1e-12);
  EXPECT_NEAR((error.pose().translation - Vector3d(0.1, 0.2, 0.5)).head<2>().norm(), 0.0, 1e-12);
  EXPECT_NEAR(error.covariance()(5, 5), frame * rest / all, 1e-15);
  EXPECT_NEAR(error.covariance()(4, 4), frame, 1e-15);
}

TEST(PathError, IsComparedWithWhatAFrameTells) {
  PathError error(0.0, 0.05, Vector3d::UnitZ(), kNoSymmetry);
  error.move_to(Pose{});
  EXPECT_EQ(error.fit(peak_at({0.0, 0.0, 0.0})).spread, 0.0);
  error.loosen(0.25e-4 * geometry::Matrix6d::Identity());
  EXPECT_NEAR(error.fit(peak_at({0.0, 0.0, 0.0})).spread, 6.0 * 0.25, 1e-9);
}

}  // namespace
}  // namespace prescene::queries
