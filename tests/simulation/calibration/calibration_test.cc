// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "prescene/core/random.h"
#include "prescene/geometry/sampling.h"
#include "prescene/simulation/calibration/ballistic_fit.h"
#include "prescene/simulation/calibration/coordinate_search.h"

namespace prescene::tests {
namespace {

using geometry::Pose;
using geometry::Vector3d;
using simulation::TimedPose;

const Vector3d kCenter(0.01, -0.02, 0.005);
const Vector3d kGravity(0.0, 0.0, -9.81);

/// Poses of a body whose centre of mass flies from p with v, turning with w, seen with noise.
std::vector<TimedPose> flight(const Vector3d& p, const Vector3d& v, const Vector3d& w, double noise,
                              double turn_noise) {
  core::RandomStream stream(4, core::Purpose::kTest);
  std::vector<TimedPose> poses;
  for (int i = 0; i < 10; ++i) {
    const double t = i / 148.0;
    TimedPose pose;
    pose.time = 3.0 + t;
    pose.X_WO.rotation = geometry::exp_rotation(turn_noise * geometry::normal_vector(stream)) *
                         geometry::exp_rotation(w * t) * geometry::exp_rotation({0.3, 0.1, -0.7});
    pose.X_WO.translation =
        p + v * t + 0.5 * t * t * kGravity - pose.X_WO.rotation * kCenter + noise * geometry::normal_vector(stream);
    poses.push_back(pose);
  }
  return poses;
}

TEST(BallisticFit, RecoversAnExactFlight) {
  const Vector3d v(0.5, -0.2, 1.0);
  const Vector3d w(3.0, -6.0, 2.0);
  const std::vector<TimedPose> poses = flight({0.1, 0.2, 0.3}, v, w, 0.0, 0.0);
  const auto fit = simulation::fit_ballistic(poses, kCenter, kGravity);
  ASSERT_TRUE(fit.ok());
  const double t = 9 / 148.0;
  const Vector3d arm = poses.back().X_WO.rotation * kCenter;
  EXPECT_LT((fit->X_WO.translation - poses.back().X_WO.translation).norm(), 1e-12);
  EXPECT_LT(geometry::angle_between(fit->X_WO.rotation, poses.back().X_WO.rotation), 1e-7);
  EXPECT_LT((fit->V_WO.angular - w).norm(), 1e-9);
  EXPECT_LT((fit->V_WO.linear - (v + t * kGravity - w.cross(arm))).norm(), 1e-9);
  EXPECT_LT(fit->position_rms, 1e-12);
}

TEST(BallisticFit, ErrorsHaveTheSizeThatLeastSquaresPromises) {
  // Over n equally spaced samples of noise s: the end point's deviation is s sqrt(2(2n-1)/(n(n+1))) = .59 s for n = 10,
  // the slope's s sqrt(12/(n(n^2-1)))/dt = .110 s/dt.
  const double s = 1e-3;
  double end = 0.0;
  double slope = 0.0;
  const int repeats = 200;
  core::RandomStream stream(9, core::Purpose::kTest);
  for (int r = 0; r < repeats; ++r) {
    std::vector<TimedPose> poses = flight({0, 0, 0}, {0.1, 0.2, 0.3}, {0, 0, 0}, 0.0, 0.0);
    const Pose truth = poses.back().X_WO;
    for (TimedPose& pose : poses) pose.X_WO.translation += s * geometry::normal_vector(stream);
    const auto fit = simulation::fit_ballistic(poses, kCenter, kGravity);
    ASSERT_TRUE(fit.ok());
    end += (fit->X_WO.translation - truth.translation).squaredNorm() / 3.0;
    slope += (fit->V_WO.linear - Vector3d(0.1, 0.2, 0.3) - 9 / 148.0 * kGravity).squaredNorm() / 3.0;
  }
  // 600 squares each: their mean is within 20 % with a false alarm rate of about 1e-3.
  EXPECT_NEAR(end / repeats, std::pow(0.588 * s, 2), 0.2 * std::pow(0.588 * s, 2));
  EXPECT_NEAR(slope / repeats, std::pow(0.110 * s * 148.0, 2), 0.2 * std::pow(0.110 * s * 148.0, 2));
}

TEST(BallisticFit, RefusesWhatItCannotFit) {
  std::vector<TimedPose> poses = flight({0, 0, 0}, {0, 0, 0}, {0, 0, 0}, 0.0, 0.0);
  EXPECT_FALSE(simulation::fit_ballistic(std::span(poses).first(2), kCenter, kGravity).ok());
  std::swap(poses[3].time, poses[4].time);
  EXPECT_FALSE(simulation::fit_ballistic(poses, kCenter, kGravity).ok());
  EXPECT_FALSE(simulation::fit_ballistic(flight({0, 0, 0}, {0, 0, 0}, {60, 0, 0}, 0.0, 0.0), kCenter, kGravity).ok());
}

TEST(CoordinateSearch, FindsTheMinimumOfATiltedBowlInsideItsBounds) {
  const auto bowl = [](std::span<const double> x) {
    const double a = x[0] - 1.3;
    const double b = x[1] + 0.4;
    return a * a + 3.0 * b * b + 0.8 * a * b;
  };
  const auto result =
      simulation::coordinate_search({{"a", 0.0, 0.5, -5.0, 5.0}, {"b", 0.0, 0.5, -5.0, 5.0}}, bowl, 14, 2000);
  EXPECT_NEAR(result.values[0], 1.3, 1e-3);
  EXPECT_NEAR(result.values[1], -0.4, 1e-3);
  EXPECT_LT(result.evaluations, 2000);

  const auto bounded =
      simulation::coordinate_search({{"a", 0.0, 0.5, -5.0, 1.0}, {"b", 0.0, 0.5, -5.0, 5.0}}, bowl, 12, 50);
  EXPECT_LE(bounded.values[0], 1.0);
  EXPECT_LE(bounded.evaluations, 50);
}

}  // namespace
}  // namespace prescene::tests
