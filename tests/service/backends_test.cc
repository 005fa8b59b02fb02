// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/backends.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "prescene/geometry/sampling.h"
#include "prescene/service/load_scene.h"
#include "prescene/simulation/similarity.h"

namespace prescene::service {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kOneBox = R"(name: box
models:
  box: {box: [0.1, 0.1, 0.1], mass: 0.4}
supports:
  floor: {ground: {size: 2}}
objects:
  box: {model: box, pose: {position: [0, 0, 0.2], rotation: any}}
)";
/// More objects than the lockstep stepper takes, one of them in the air.
std::string many_boxes() {
  std::string text = R"(name: boxes
models:
  box: {box: [0.1, 0.1, 0.1], mass: 0.4}
supports:
  floor: {ground: {size: 8}}
objects:
)";
  for (int i = 0; i < 17; ++i)
    text += "  box" + std::to_string(i) + ": {model: box, pose: {position: [" + std::to_string(0.4 * (i % 5)) + ", " +
            std::to_string(0.4 * (i / 5)) + (i == 3 ? ", 0.3]}}\n" : ", 0.05]}}\n");
  return text;
}

// A drawer of 1 kg that begins at 0.6 m/s: 0.18 J are rubbed off by 1 N on 0.18 m, by 2 N on 0.09 m.
constexpr const char* kDrawer = R"(name: drawer
models:
  drawer: {box: [0.3, 0.3, 0.1], mass: 1.0}
objects:
  drawer: {model: drawer, pose: {position: [0, 0, 0.5]}, velocity: [0.6, 0, 0]}
joints:
  slide: {type: slider, parent: world, child: drawer, axis: x, min: 0, max: 0.4, friction: {samples: [1, 1, 1, 2]}}
outcomes:
  opens_wide: {joint: {name: slide, min: 0.15}}
)";

std::shared_ptr<const belief::Scene> scene_of(const std::string& text) {
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
  belief::Pull pull;
  pull.object = "box";
  pull.by = {0.1, 0.0, 0.0};
  EXPECT_TRUE(same(runs(**automatic, *one, {{0.05, pull}}), runs(**bullet, *one, {{0.05, pull}})));
  EXPECT_EQ(either.stepper_counts().last_reason, "the action pull is not simulated in lockstep");
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
  const auto asked = [&](Stepper stepper, const std::string& scene) {
    Backends backends(pool, settings_of(stepper));
    return queries::answer(scene_of(scene), 1, {"", query}, backends.query_context(pool));
  };
  const auto predicted = [&](Stepper stepper, const std::string& scene) {
    const belief::Answer answer = asked(stepper, scene);
    EXPECT_TRUE(answer.error.ok()) << answer.error.message();
    return std::get<belief::PredictAnswer>(answer.what);
  };
  EXPECT_EQ(predicted(Stepper::kAutomatic, kOneBox).stepper, "lockstep");
  EXPECT_EQ(predicted(Stepper::kAutomatic, kOneBox).not_lockstep, "");
  EXPECT_EQ(predicted(Stepper::kBullet, many_boxes()).stepper, "bullet");
  EXPECT_EQ(predicted(Stepper::kBullet, many_boxes()).not_lockstep, "");
  EXPECT_EQ(predicted(Stepper::kAutomatic, many_boxes()).stepper, "bullet");
  EXPECT_THAT(predicted(Stepper::kAutomatic, many_boxes()).not_lockstep, HasSubstr("the scene has 17"));
  const belief::Answer refused = asked(Stepper::kLockstep, many_boxes());
  EXPECT_EQ(refused.error.code(), core::StatusCode::kUnsupported);
  EXPECT_THAT(refused.error.message(), HasSubstr("the scene has 17"));
}

TEST(Backends, AnswersTellWhereJointsEnd) {
  core::ThreadPool pool(1);
  Backends backends(pool, settings_of(Stepper::kAutomatic));
  belief::PredictQuery query;
  query.effort.exact_instances = 64;
  const auto scene = scene_of(kDrawer);
  const belief::Answer answer = queries::answer(scene, 1, {"", query}, backends.query_context(pool));
  ASSERT_TRUE(answer.error.ok()) << answer.error.message();
  const auto& predicted = std::get<belief::PredictAnswer>(answer.what);
  EXPECT_EQ(predicted.stepper, "bullet");
  EXPECT_THAT(predicted.not_lockstep, HasSubstr("the joint slide"));
  ASSERT_EQ(predicted.outcomes.size(), 1u);
  EXPECT_NEAR(predicted.outcomes[0].probability, 0.75, 0.02);
  ASSERT_EQ(predicted.joints.size(), 1u);
  EXPECT_EQ(predicted.joints[0].joint, "slide");
  EXPECT_NEAR(predicted.joints[0].middle, 0.18, 0.003);
  EXPECT_NEAR(predicted.joints[0].low, 0.09, 0.003);
  EXPECT_NEAR(predicted.joints[0].mean, 0.75 * 0.18 + 0.25 * 0.09, 0.003);

  const auto refused = [&](const belief::PredictQuery& asked) {
    return queries::answer(scene, 1, {"", asked}, backends.query_context(pool)).error.message();
  };
  belief::PredictQuery held = query;
  held.actions = {{0.1, belief::Transport{"drawer", belief::FixedPose{}, 0.5}}};
  EXPECT_THAT(refused(held), HasSubstr("no hand can hold it"));
  belief::PredictQuery beyond = query;
  beyond.outcomes = {{"o", "", {{belief::JointWithin{"slide", belief::JointType::kSlider, 0.5}}}}};
  EXPECT_THAT(refused(beyond), HasSubstr("never gets there"));
}

TEST(Backends, QueriesKnowHowTheirSimulatorsRoundEdges) {
  core::ThreadPool pool(1);
  BackendSettings settings;
  settings.bullet.edge_rounding = 3e-3;
  EXPECT_EQ(Backends(pool, settings).query_context(pool).edge_rounding, 3e-3);
}

TEST(Backends, AutomaticStepperIsBulletWhereLockstepRefusesTheScene) {
  core::ThreadPool pool(1);
  const auto many = scene_of(many_boxes());
  const auto bullet = Backends(pool, settings_of(Stepper::kBullet)).make_simulator(*many);
  Backends either(pool, settings_of(Stepper::kAutomatic));
  const auto automatic = either.make_simulator(*many);
  ASSERT_TRUE(bullet.ok() && automatic.ok());
  EXPECT_TRUE(same(runs(**automatic, *many, {}), runs(**bullet, *many, {})));
  EXPECT_EQ((*automatic)->stepper().name, "bullet");
  EXPECT_THAT((*automatic)->stepper().not_lockstep, HasSubstr("the scene has 17"));
  EXPECT_EQ(either.stepper_counts().lockstep, 0u);
  EXPECT_EQ(either.stepper_counts().bullet_instead, 1u);
  EXPECT_THAT(either.stepper_counts().last_reason, HasSubstr("the scene has 17"));

  const auto refused = Backends(pool, settings_of(Stepper::kLockstep)).make_simulator(*many);
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.status().message(), HasSubstr("lockstep"));
}

/// A box of `size` times 10 cm that is let go tilted, 40 of its lengths away from the origin.
belief::PredictAnswer dropped(double size) {
  core::ThreadPool pool(2);
  Backends backends(pool, settings_of(Stepper::kAutomatic));
  const auto metres = [&](double value) { return std::to_string(value * size); };
  const auto scene = scene_of(
      "name: box\nduration: " + std::to_string(3.0 * std::sqrt(size)) + "\nmodels:\n  box: {box: [" + metres(0.1) +
      ", " + metres(0.1) + ", " + metres(0.2) + "], mass: " + std::to_string(size * size * size) +
      "}\nsupports:\n  floor: {ground: {size: " + metres(12.0) +
      "}}\nobjects:\n  box: {model: box, pose: {position: [" + metres(4.0) + ", 0, " + metres(0.14) +
      "], rotation: {euler_deg: [0, 22, 0]}, normal: {rotation_deg: [0, 8, 0]}}}\n"
      "outcomes:\n  stands: {object: box, upright: {within_deg: 10}}\n");
  belief::PredictQuery query;
  query.effort.exact_instances = 512;
  const belief::Answer answer = queries::answer(scene, 1, {"", query}, backends.query_context(pool));
  EXPECT_TRUE(answer.error.ok()) << answer.error.message();
  return std::get<belief::PredictAnswer>(answer.what);
}

// What is large is in the same world as what is small: it ends farther away.
TEST(Backends, HugeThingsEndAsSmallOnesDo) {
  const belief::PredictAnswer small = dropped(1.0), huge = dropped(40.0);
  ASSERT_EQ(small.outcomes.size(), 1u);
  EXPECT_GT(small.outcomes[0].probability, 0.2);
  EXPECT_LT(small.outcomes[0].probability, 0.8);
  EXPECT_NEAR(huge.outcomes[0].probability, small.outcomes[0].probability, 0.02);
  EXPECT_THAT(huge.remarks, Not(Contains(HasSubstr("world's origin"))));
}

constexpr const char* kThrownBox = R"(name: box
models:
  box: {box: [0.1, 0.1, 0.1], mass: 0.4}
supports:
  floor: {ground: {size: 20}}
objects:
  box: {model: box, pose: {position: [0, 0, 0.2]}}
)";

/// One of three faces up, of dice thrown with speeds that belong to their size.
std::vector<int> faces(double size, Stepper stepper) {
  core::ThreadPool pool(2);
  Backends backends(pool, settings_of(stepper));
  const belief::Scene scene = simulation::scaled(*scene_of(kThrownBox), simulation::Similarity{size / 0.1});
  const auto simulator = backends.make_simulator(scene);
  EXPECT_TRUE(simulator.ok()) << simulator.status().message();
  const simulation::Similarity similarity{size / 0.1};
  core::RandomStream stream(1, core::Purpose::kTest);
  std::vector<belief::WorldState> starts;
  for (int i = 0; i < 200; ++i) {
    belief::WorldState start = belief::mean_start(scene);
    start.objects[0].X_WO.rotation = geometry::uniform_rotation(stream);
    const double v_y = stream.normal(), v_x = stream.normal();
    start.objects[0].V_WO.linear = Eigen::Vector3d(v_x, v_y, 0.0) * std::sqrt(size / 0.1);
    const double rate_z = stream.normal(), rate_y = stream.normal(), rate_x = stream.normal();
    start.objects[0].V_WO.angular = Eigen::Vector3d(rate_x, rate_y, rate_z) * 5.0 / similarity.time();
    starts.push_back(start);
  }
  std::vector<belief::Trajectory> trajectories(starts.size());
  simulation::RunRequest request;
  request.stop.duration = 5.0 * similarity.time();
  request.stop.world_radius *= similarity.length;
  (*simulator)->run(starts, request, stream, 0, pool, trajectories);
  std::vector<int> up;
  for (const belief::Trajectory& trajectory : trajectories) {
    EXPECT_EQ(trajectory.end, belief::TrajectoryEnd::kAtRest);
    EXPECT_NEAR(trajectory.final().objects[0].X_WO.translation.z(), 0.5 * size, 0.01 * size);
    Eigen::Index axis = 0;
    trajectory.final().objects[0].X_WO.rotation.toRotationMatrix().row(2).cwiseAbs().maxCoeff(&axis);
    up.push_back(static_cast<int>(axis));
  }
  return up;
}

TEST(Backends, WhatHappensDoesNotDependOnTheSize) {
  for (const Stepper stepper : {Stepper::kBullet, Stepper::kLockstep}) {
    const std::vector<int> expected = faces(0.1, stepper);
    for (const double size : {0.1 / 64, 0.1 / 8, 0.8, 6.4}) {
      const std::vector<int> found = faces(size, stepper);
      // Rounding differs and some throws are chaotic; each of the others ends on the same face.
      int alike = 0;
      for (std::size_t i = 0; i < found.size(); ++i) alike += found[i] == expected[i] ? 1 : 0;
      EXPECT_GE(alike, 180) << size;
    }
  }
}

TEST(Backends, StepsFitTheSizeUnlessTheSceneSaysThem) {
  core::ThreadPool pool(1);
  Backends backends(pool);
  belief::Scene small = simulation::scaled(*scene_of(kOneBox), simulation::Similarity{0.04});
  EXPECT_NEAR((*backends.make_simulator(*scene_of(kOneBox)))->step_size(), 1.0 / 240.0, 1e-12);
  EXPECT_NEAR((*backends.make_simulator(small))->step_size(), 0.2 / 240.0, 1e-12);
  EXPECT_NEAR((*backends.make_simulator(small))->length_scale(), 0.04, 1e-12);
  EXPECT_NEAR((*backends.make_simulator(small, 0.5))->step_size(), 0.1 / 240.0, 1e-12);
  small.step = 0.001;
  EXPECT_NEAR((*backends.make_simulator(small))->step_size(), 0.001, 1e-12);
}

}  // namespace
}  // namespace prescene::service
