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

BackendSettings settings_of(Stepper stepper) {
  BackendSettings settings;
  settings.stepper = stepper;
  return settings;
}

simulation::RunRequest request_of(const std::vector<belief::Action>& actions) {
  simulation::RunRequest request;
  request.actions = actions;
  return request;
}

const std::vector<belief::Action> kPushes(17, {0.05, belief::Push{{-0.3, 0, 0.05}, {0.1, 0, 0.05}}});

TEST(Backends, LockstepRunsWhatItCanAndBulletTheRest) {
  core::ThreadPool pool(1);
  Backends bullets(pool, settings_of(Stepper::kBullet)), lanes(pool, settings_of(Stepper::kLockstep)),
      either(pool, settings_of(Stepper::kAutomatic));
  const auto one = scene_of(kOneBox);
  const auto bullet = bullets.make_simulator(*one);
  const auto lockstep = lanes.make_simulator(*one);
  const auto automatic = either.make_simulator(*one);
  ASSERT_TRUE(bullet.ok() && lockstep.ok() && automatic.ok());
  EXPECT_FALSE(same(runs(**bullet, *one, {}), runs(**lockstep, *one, {})));
  EXPECT_TRUE(same(runs(**automatic, *one, {}), runs(**lockstep, *one, {})));
  EXPECT_EQ((*bullet)->stepper().name, "bullet");
  EXPECT_EQ((*lockstep)->stepper().name, "lockstep");
  EXPECT_EQ((*automatic)->stepper().name, "lockstep");
  EXPECT_EQ(either.stepper_counts().lockstep, 1u);
  EXPECT_EQ(either.stepper_counts().bullet_instead, 0u);

  // A request may ask for more than its scene does. Bullet's stepper takes such a run over, and that is counted.
  EXPECT_TRUE((*automatic)->supports(request_of(kPushes)).ok());
  EXPECT_TRUE(same(runs(**automatic, *one, kPushes), runs(**bullet, *one, kPushes)));
  EXPECT_EQ(either.stepper_counts().bullet_instead, 1u);
  EXPECT_THAT(either.stepper_counts().last_reason, HasSubstr("17 push actions"));
  // Nobody is instead of anybody where one of them was asked for.
  EXPECT_EQ(bullets.stepper_counts().bullet_instead, 0u);
  EXPECT_EQ(lanes.stepper_counts().bullet_instead, 0u);
}

TEST(Backends, LockstepAloneRefusesWhatItCannotRun) {
  core::ThreadPool pool(1);
  Backends backends(pool, settings_of(Stepper::kLockstep));
  const auto one = scene_of(kOneBox);
  const auto lockstep = backends.make_simulator(*one);
  ASSERT_TRUE(lockstep.ok());
  EXPECT_TRUE((*lockstep)->supports(request_of({kPushes.begin(), kPushes.begin() + 16})).ok());
  const core::Status refused = (*lockstep)->supports(request_of(kPushes));
  EXPECT_EQ(refused.code(), core::StatusCode::kUnsupported);
  EXPECT_THAT(refused.message(), HasSubstr("17 push actions"));

  belief::Scene pushed = *one;
  pushed.actions = kPushes;
  const core::Status scene_refused = backends.make_simulator(pushed).status();
  EXPECT_EQ(scene_refused.code(), core::StatusCode::kUnsupported);
  EXPECT_THAT(scene_refused.message(), HasSubstr("17 push actions"));
  EXPECT_THAT(scene_refused.message(), HasSubstr("--stepper bullet"));
}

TEST(Backends, AnswersTellWhoSimulatedAndWhyItWasNotLockstep) {
  core::ThreadPool pool(1);
  belief::PredictQuery query;
  query.effort.exact_instances = 8;
  query.duration = 0.1;
  const auto asked = [&](Stepper stepper, const char* scene) {
    Backends backends(pool, settings_of(stepper));
    return queries::answer(scene_of(scene), 1, {"", query}, backends.query_context(pool));
  };
  const auto predicted = [&](Stepper stepper, const char* scene) {
    const belief::Answer answer = asked(stepper, scene);
    EXPECT_TRUE(answer.error.ok()) << answer.error.message();
    return std::get<belief::PredictAnswer>(answer.what);
  };
  EXPECT_EQ(predicted(Stepper::kAutomatic, kOneBox).stepper, "lockstep");
  EXPECT_EQ(predicted(Stepper::kAutomatic, kOneBox).not_lockstep, "");
  EXPECT_EQ(predicted(Stepper::kBullet, kFiveBoxes).stepper, "bullet");
  EXPECT_EQ(predicted(Stepper::kBullet, kFiveBoxes).not_lockstep, "");
  EXPECT_EQ(predicted(Stepper::kAutomatic, kFiveBoxes).stepper, "bullet");
  EXPECT_THAT(predicted(Stepper::kAutomatic, kFiveBoxes).not_lockstep, HasSubstr("the scene has 5"));
  const belief::Answer refused = asked(Stepper::kLockstep, kFiveBoxes);
  EXPECT_EQ(refused.error.code(), core::StatusCode::kUnsupported);
  EXPECT_THAT(refused.error.message(), HasSubstr("the scene has 5"));
}

TEST(Backends, QueriesKnowHowTheirSimulatorsRoundEdges) {
  core::ThreadPool pool(1);
  BackendSettings settings;
  settings.bullet.edge_rounding = 3e-3;
  EXPECT_EQ(Backends(pool, settings).query_context(pool).edge_rounding, 3e-3);
}

TEST(Backends, AutomaticStepperIsBulletWhereLockstepRefusesTheScene) {
  core::ThreadPool pool(1);
  const auto five = scene_of(kFiveBoxes);
  const auto bullet = Backends(pool, settings_of(Stepper::kBullet)).make_simulator(*five);
  Backends either(pool, settings_of(Stepper::kAutomatic));
  const auto automatic = either.make_simulator(*five);
  ASSERT_TRUE(bullet.ok() && automatic.ok());
  EXPECT_TRUE(same(runs(**automatic, *five, {}), runs(**bullet, *five, {})));
  EXPECT_EQ((*automatic)->stepper().name, "bullet");
  EXPECT_THAT((*automatic)->stepper().not_lockstep, HasSubstr("the scene has 5"));
  EXPECT_EQ(either.stepper_counts().lockstep, 0u);
  EXPECT_EQ(either.stepper_counts().bullet_instead, 1u);
  EXPECT_THAT(either.stepper_counts().last_reason, HasSubstr("the scene has 5"));

  const auto refused = Backends(pool, settings_of(Stepper::kLockstep)).make_simulator(*five);
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.status().message(), HasSubstr("lockstep"));
}

}  // namespace
}  // namespace prescene::service
