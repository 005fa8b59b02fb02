// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/calibration/sliding_fit.h"

#include <gtest/gtest.h>

#include <cmath>

namespace prescene::tests {
namespace {

using geometry::Vector3d;
using simulation::fit_sliding;
using simulation::TimedPose;

/// Slower by 2 m/s^2 along its way, and by 3 rad/s^2 about the vertical.
std::vector<TimedPose> slide(int frames) {
  std::vector<TimedPose> poses;
  const Vector3d along = Vector3d(0.6, 0.8, 0.0);
  for (int i = 0; i < frames; ++i) {
    const double t = i / 120.0;
    TimedPose pose;
    pose.time = 2.0 + t;
    pose.X_WO.translation = Vector3d(0.1, 0.2, 0.05) + (1.2 * t - t * t) * along;
    pose.X_WO.rotation = geometry::exp_rotation({0.0, 0.0, 0.4 + 1.5 * t - 1.5 * t * t});
    poses.push_back(pose);
  }
  return poses;
}

TEST(SlidingFit, RecoversAnExactSlide) {
  const auto poses = slide(8);
  const auto fit = fit_sliding(poses);
  ASSERT_TRUE(fit.ok()) << fit.status().message();
  const double t = 7 / 120.0;
  EXPECT_LT((fit->state.X_WO.translation - poses.back().X_WO.translation).norm(), 1e-12);
  EXPECT_LT(geometry::angle_between(fit->state.X_WO.rotation, poses.back().X_WO.rotation), 1e-7);
  EXPECT_LT((fit->state.V_WO.linear - (1.2 - 2.0 * t) * Vector3d(0.6, 0.8, 0.0)).norm(), 1e-9);
  EXPECT_LT((fit->state.V_WO.angular - Vector3d(0.0, 0.0, 1.5 - 3.0 * t)).norm(), 1e-9);
  EXPECT_LT((fit->direction_W - Vector3d(0.6, 0.8, 0.0)).norm(), 1e-9);
  EXPECT_LT(fit->state.position_rms, 1e-12);
  EXPECT_EQ(fit->state.time, poses.back().time);
}

TEST(SlidingFit, RefusesWhatItCannotFit) {
  EXPECT_FALSE(fit_sliding(slide(4)).ok());
  auto poses = slide(8);
  std::swap(poses[2].time, poses[3].time);
  EXPECT_FALSE(fit_sliding(poses).ok());
  poses = slide(8);
  poses[0].X_WO.rotation = poses[0].X_WO.rotation * geometry::exp_rotation({0.0, 0.0, 2.5});
  EXPECT_FALSE(fit_sliding(poses).ok());
}

}  // namespace
}  // namespace prescene::tests
