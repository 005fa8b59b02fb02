// SPDX-License-Identifier: Apache-2.0
// A cloud of starts in free flight: mean and covariance of place and velocity are carried on by the linear map of the
// flight, P' = F P F^T. Errors of one step are those of the next, so adding them up as if they were independent is
// wrong by a factor that grows with the number of steps.
#include <gtest/gtest.h>

#include <cmath>

#include "prescene/simulation/bullet/bullet_simulator.h"
#include "prescene/simulation/outcomes/start_distribution.h"
#include "tests/support/uncertain_scenes.h"

namespace prescene::simulation {
namespace {

using geometry::Matrix6d;
using geometry::Vector6d;

struct Moments {
  Vector6d mean = Vector6d::Zero();
  Matrix6d covariance = Matrix6d::Zero();
};

/// Of place and velocity of the only object.
Moments moments_of(const std::vector<belief::WorldState>& states) {
  std::vector<Vector6d> all;
  Moments found;
  for (const belief::WorldState& state : states) {
    Vector6d x;
    x << state.objects[0].X_WO.translation, state.objects[0].V_WO.linear;
    all.push_back(x);
    found.mean += x / static_cast<double>(states.size());
  }
  for (const Vector6d& x : all)
    found.covariance += (x - found.mean) * (x - found.mean).transpose() / static_cast<double>(states.size());
  return found;
}

TEST(FlightMomentsLaws, MeanAndCovarianceAreThoseOfTheClosedForm) {
  auto scene = std::make_shared<belief::Scene>(tests::tumbling_box());
  scene->objects[0].twist.linear.z = belief::NormalScalar{2.0, 0.05};
  belief::NormalPose pose = std::get<belief::NormalPose>(scene->objects[0].pose);
  pose.covariance.diagonal().tail<3>() << 1e-6, 4e-6, 2e-6;
  scene->objects[0].pose = pose;
  const StartDistribution starts = start_of(scene);
  const StartSampler sampler(starts.components[0], 3);
  std::vector<belief::WorldState> before;
  for (std::uint32_t i = 0; i < 512; ++i) before.push_back(sampler.draw(i));

  ShapeStore shapes;
  const auto simulator = *make_bullet_simulator(*scene, shapes);
  RunRequest request;
  request.stop.duration = 0.3;  // 72 steps, all above the floor
  std::vector<belief::Trajectory> runs(before.size());
  core::ThreadPool pool(2);
  simulator->run(before, request, core::RandomStream(1, core::Purpose::kTest), 0, pool, runs);
  std::vector<belief::WorldState> after;
  for (const belief::Trajectory& run : runs) after.push_back(run.final());

  const Moments from = moments_of(before), to = moments_of(after);
  const double t = runs[0].simulated_seconds;
  ASSERT_NEAR(t, 0.3, 1e-12);
  Matrix6d F = Matrix6d::Identity();
  F.topRightCorner<3, 3>() = t * geometry::Matrix3d::Identity();
  Vector6d fallen;
  fallen << 0.5 * t * t * scene->gravity_W, t * scene->gravity_W;
  EXPECT_LT((to.mean - F * from.mean - fallen).norm(), 1e-10);
  const Matrix6d carried = F * from.covariance * F.transpose();
  EXPECT_LT((to.covariance - carried).norm(), 1e-10 * carried.norm());
}

}  // namespace
}  // namespace prescene::simulation
