// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/backends.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "prescene/service/load_scene.h"

namespace prescene::service {
namespace {

using ::testing::HasSubstr;

constexpr const char* kOneBox = R"(name: box
models:
  box: {box: [0.1, 0.1, 0.1], mass: 0.4}
supports:
  floor: {ground: {size: 2}}
objects:
  box: {model: box, pose: {position: [0, 0, 0.2], rotation: any}}
)";
constexpr const char* kFiveBoxes = R"(name: boxes
models:
  box: {box: [0.1, 0.1, 0.1], mass: 0.4}
supports:
  floor: {ground: {size: 4}}
objects:
  a: {model: box, pose: {position: [0, 0, 0.05]}}
  b: {model: box, pose: {position: [0.4, 0, 0.3]}}
  c: {model: box, pose: {position: [0.8, 0, 0.05]}}
  d: {model: box, pose: {position: [1.2, 0, 0.05]}}
  e: {model: box, pose: {position: [1.6, 0, 0.05]}}
)";

std::shared_ptr<const belief::Scene> scene_of(const char* text) {
  const auto scene = load_scene_text(text, "test.yaml", {});
  EXPECT_TRUE(scene.ok()) << scene.status().message();
  return *scene;
}

std::vector<belief::Trajectory> runs(const simulation::Simulator& simulator, const belief::Scene& scene,
                                     const std::vector<belief::Action>& actions) {
  core::ThreadPool pool(1);
  std::vector<belief::WorldState> starts(3, belief::mean_start(scene));
  for (std::size_t i = 0; i < starts.size(); ++i) {
    starts[i].objects[0].X_WO.translation.z() += 0.05 * static_cast<double>(i);
    starts[i].objects[0].X_WO.rotation =
        Eigen::AngleAxisd(0.3 + 0.2 * static_cast<double>(i), Eigen::Vector3d::UnitX());
  }
  std::vector<belief::Trajectory> trajectories(starts.size());
  simulation::RunRequest request;
  request.actions = actions;
  simulator.run(starts, request, core::RandomStream(1, core::Purpose::kTest), 0, pool, trajectories);
  return trajectories;
}

bool same(const std::vector<belief::Trajectory>& a, const std::vector<belief::Trajectory>& b) {
  return std::ranges::equal(a, b, [](const belief::Trajectory& left, const belief::Trajectory& right) {
    const geometry::Pose& X_left = left.final().objects[0].X_WO;
    const geometry::Pose& X_right = right.final().objects[0].X_WO;
    return X_left.translation == X_right.translation && X_left.rotation.coeffs() == X_right.rotation.coeffs();
  });
}

TEST(Backends, LockstepRunsWhatItCanAndBulletTheRest) {
  core::ThreadPool pool(1);
  const auto simulator_of = [&](Stepper stepper, const belief::Scene& scene) {
    BackendSettings settings;
    settings.stepper = stepper;
    return Backends(pool, settings).make_simulator(scene);
  };
  const auto one = scene_of(kOneBox);
  const auto bullet = simulator_of(Stepper::kBullet, *one);
  const auto lockstep = simulator_of(Stepper::kLockstep, *one);
  const auto automatic = simulator_of(Stepper::kAutomatic, *one);
  ASSERT_TRUE(bullet.ok() && lockstep.ok() && automatic.ok());
  EXPECT_FALSE(same(runs(**bullet, *one, {}), runs(**lockstep, *one, {})));
  EXPECT_TRUE(same(runs(**automatic, *one, {}), runs(**lockstep, *one, {})));

  const std::vector<belief::Action> pushed(17, {0.05, belief::Push{{-0.3, 0, 0.05}, {0.1, 0, 0.05}}});
  EXPECT_TRUE(same(runs(**lockstep, *one, pushed), runs(**bullet, *one, pushed)));
}

TEST(Backends, QueriesKnowHowTheirSimulatorsRoundEdges) {
  core::ThreadPool pool(1);
  BackendSettings settings;
  settings.bullet.edge_rounding = 3e-3;
  EXPECT_EQ(Backends(pool, settings).query_context(pool).edge_rounding, 3e-3);
}

TEST(Backends, AutomaticStepperIsBulletWhereLockstepRefusesTheScene) {
  core::ThreadPool pool(1);
  BackendSettings settings;
  const auto five = scene_of(kFiveBoxes);
  const auto bullet = Backends(pool, settings).make_simulator(*five);
  settings.stepper = Stepper::kAutomatic;
  const auto automatic = Backends(pool, settings).make_simulator(*five);
  ASSERT_TRUE(bullet.ok() && automatic.ok());
  EXPECT_TRUE(same(runs(**automatic, *five, {}), runs(**bullet, *five, {})));

  settings.stepper = Stepper::kLockstep;
  const auto refused = Backends(pool, settings).make_simulator(*five);
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.status().message(), HasSubstr("lockstep"));
}

}  // namespace
}  // namespace prescene::service
