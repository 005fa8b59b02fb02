// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/operators/predict.h"

#include <gtest/gtest.h>

#include <cmath>

#include "predict_fixture.h"
#include "tests/support/matchers.h"

namespace prescene::filter_tests {
namespace {

using belief::MotionMode;
using belief::Particle;

TEST(RobotBounds, AreThoseOfTheShapesThatABodyHasNow) {
  const auto box = [](double half, const Vector3d& at) {
    return belief::PrimitiveShape{geometry::BoxShape{Vector3d::Constant(2.0 * half)}, Pose::from_translation(at)};
  };
  RobotBounds bounds;
  EXPECT_TRUE(bounds.of(3, {}).isEmpty());
  for (const double half : {0.1, 0.1, 0.2}) {
    const geometry::Box& one = bounds.of(0, {box(half, {1.0, 0.0, 0.0}), box(half, {0.0, 0.0, 2.0})});
    EXPECT_LT((one.min() - Vector3d::Constant(-half)).norm(), 1e-12);
    EXPECT_LT((one.max() - Vector3d(1.0 + half, half, 2.0 + half)).norm(), 1e-12);
  }
  EXPECT_LT((bounds.of(1, {box(0.3, Vector3d::Zero())}).max() - Vector3d::Constant(0.3)).norm(), 1e-12);
  EXPECT_LT((bounds.of(0, {box(0.3, Vector3d::Zero())}).min() + Vector3d::Constant(0.3)).norm(), 1e-12);
  EXPECT_TRUE(bounds.of(3, {}).isEmpty());
}

TEST_F(Predict, RestingStaysWhereItIsAndGrowsALittleUnsure) {
  belief::Belief belief = hand_and_object(MotionMode::kResting, false);
  const belief::Belief before = belief;
  run(belief, before.robot[0], 0.04, without_mode_changes());
  for (std::size_t i = 0; i < 16; ++i) {
    const Particle& particle = belief.objects[0].particles[i];
    EXPECT_EQ(particle.X_WO, before.objects[0].particles[i].X_WO);
    EXPECT_EQ(particle.log_weight, before.objects[0].particles[i].log_weight);
    EXPECT_NEAR(particle.covariance(3, 3), 1e-6 + 0.0001 * 0.0001 * 0.04, 1e-15);
    EXPECT_EQ(particle.covariance(9, 9), 1e-6);
  }
}

TEST_F(Predict, WhatWakesWeighsAsMuchAsThingsBeginToMove) {
  belief::Belief belief = hand_and_object(MotionMode::kResting, false);
  PredictOptions options;
  const double dt = 0.05;
  double moving_weight = 0.0, sum = 0.0;
  int woken = 0;
  constexpr int kSteps = 200;
  for (int step = 0; step < kSteps; ++step) {
    belief::Belief next = belief;
    next.step = belief.step + static_cast<std::uint64_t>(step);
    run(next, belief.robot[0], dt, options);
    int mine = 0;
    for (const Particle& particle : next.objects[0].particles) {
      const bool moves = particle.mode == MotionMode::kMoving;
      mine += moves;
      moving_weight += moves ? std::exp(particle.log_weight) : 0.0;
      sum += std::exp(particle.log_weight);
    }
    // Some of them in every frame, whatever the chance.
    EXPECT_GE(mine, 5) << step;
    EXPECT_LE(mine, 6) << step;
    woken += mine;
  }
  EXPECT_NEAR(sum, kSteps, 1e-9);
  EXPECT_NEAR(woken / (16.0 * kSteps), 3.0 * options.wake_probability, 0.01);
  EXPECT_NEAR(moving_weight / kSteps, dt / 5.0, 0.05 * dt / 5.0);  // once in five seconds
}

TEST_F(Predict, WhatNothingNewIsSeenOfKeepsItsModesAndWeights) {
  belief::Belief belief = hand_and_object(MotionMode::kResting, false);
  for (std::size_t i = 0; i < 8; ++i) belief.objects[0].particles[i].mode = MotionMode::kMoving;
  const Pose X_WG = belief.robot[0], poses[] = {X_WG};
  const std::vector<bool> keeps = {true};
  for (int step = 0; step < 100; ++step) {
    ++belief.step;
    predict(belief, {}, poses, 1.0 / 30.0, {}, {{}, bounds_, stream_, threads_}, {}, keeps);
  }
  for (std::size_t i = 0; i < 16; ++i) {
    EXPECT_EQ(belief.objects[0].particles[i].mode, i < 8 ? MotionMode::kMoving : MotionMode::kResting) << i;
    EXPECT_EQ(belief.objects[0].particles[i].log_weight, -std::log(16.0)) << i;
  }
}

TEST_F(Predict, InAHandThatStandsStillItIsStill) {
  belief::Belief belief = hand_and_object(MotionMode::kHeld, true);
  const Pose X_WG = belief.robot[0];
  run(belief, X_WG, 0.04, without_mode_changes());
  for (const Particle& particle : belief.objects[0].particles)
    EXPECT_NEAR(particle.covariance(3, 3), 1e-6 + 0.0001 * 0.0001 * 0.04, 1e-15);
  run(belief, X_WG * Pose::from_translation({0.001, 0.0, 0.0}), 0.04, without_mode_changes());
  for (const Particle& particle : belief.objects[0].particles)
    EXPECT_NEAR(particle.covariance(3, 3), 1e-6 + (0.0001 * 0.0001 + 0.01 * 0.01) * 0.04, 1e-12);
}

TEST_F(Predict, HiddenRestingIsForgottenNoFasterThanItMayCreep) {
  // A minute of frames in which it is not seen: only the random walk remains.
  belief::Belief belief = hand_and_object(MotionMode::kResting, false);
  belief.objects[0].state = belief::TrackState::kUnseen;
  for (int i = 0; i < 1800; ++i) run(belief, belief.robot[0], 1.0 / 30.0, without_mode_changes());
  for (const Particle& particle : belief.objects[0].particles)
    EXPECT_NEAR(particle.covariance(3, 3), 1e-6 + 0.0006 * 0.0006 * 60.0, 1e-9);
}

TEST_F(Predict, WhatIsHiddenAndStaysByPhysicsIsForgottenNoFasterThanWhatRests) {
  for (const double shift : {0.0, 0.02}) {  // m, by which physics moves it in each step
    const simulation::SimulatorFactory source = [&](const belief::Scene&, double) {
      return by_formula([=](const belief::WorldState& start, const simulation::RunRequest&, core::RandomStream) {
        belief::WorldState end = start;
        end.objects[0].X_WO.translation.x() += shift;
        return end;
      });
    };
    belief::Belief belief = hand_and_object(MotionMode::kMoving, false);
    belief.objects[0].state = belief::TrackState::kUnseen;
    for (int i = 0; i < 20; ++i) run(belief, belief.robot[0], 0.1, without_mode_changes(), {}, source);
    for (const Particle& particle : belief.objects[0].particles) {
      if (shift > 0.0) {
        EXPECT_GT(particle.covariance(3, 3), 1e-3);
      } else {
        EXPECT_NEAR(particle.covariance(3, 3), 1e-6 + 0.0006 * 0.0006 * 2.0, 1e-9);
      }
    }
  }
}

TEST_F(Predict, AVelocityThatAgreesWithNoneSettlesAndIsNotSimulated) {
  int simulated = 0;
  const simulation::SimulatorFactory source = [&](const belief::Scene&, double) {
    ++simulated;
    return by_formula(
        [](const belief::WorldState& start, const simulation::RunRequest&, core::RandomStream) { return start; });
  };
  PredictOptions options = without_mode_changes();
  options.physics_share = 1.0;
  options.settle_probability = 1.0;
  for (const double deviation : {0.01, 0.1}) {  // of the velocity, which is 10 cm/s
    belief::Belief belief = hand_and_object(MotionMode::kMoving, false);
    for (Particle& particle : belief.objects[0].particles) {
      particle.V_WO.linear.x() = 0.1;
      particle.covariance.bottomRightCorner<6, 6>() = deviation * deviation * geometry::Matrix6d::Identity();
    }
    run(belief, belief.robot[0], 0.04, options, {}, source);
    const MotionMode expected = deviation > 0.05 ? MotionMode::kResting : MotionMode::kMoving;
    for (const Particle& particle : belief.objects[0].particles) EXPECT_EQ(particle.mode, expected);
    EXPECT_EQ(simulated, 1);
  }
}

TEST_F(Predict, HeldMovesRigidlyWithItsHand) {
  belief::Belief belief = hand_and_object(MotionMode::kHeld, true);
  const Pose X_GO = belief.robot[0].inverse() * belief.objects[0].particles[0].X_WO;
  Pose X_WG = belief.robot[0];
  X_WG.rotation = geometry::exp_rotation({0.2, 0.1, -0.3});
  X_WG.translation += Vector3d(0.03, 0.02, -0.01);
  run(belief, X_WG, 0.1, without_mode_changes());
  for (const Particle& particle : belief.objects[0].particles) {
    EXPECT_THAT(particle.X_WO, tests::is_near(X_WG * X_GO, 1e-9, 1e-9));
    EXPECT_EQ(particle.mode, MotionMode::kHeld);
    // The twist is that of the motion over the step.
    EXPECT_THAT(Vector3d(0.1 * particle.V_WO.angular), tests::is_near(Vector3d(0.2, 0.1, -0.3), 1e-9));
  }
  EXPECT_EQ(belief.robot[0], X_WG);
}

TEST_F(Predict, ReleasedLeavesTheHandAtItsTimeWithTheHandsVelocity) {
  belief::Belief belief = hand_and_object(MotionMode::kHeld, true);
  const Pose X_WG = Pose::from_translation({0.2, 0.0, 0.4});  // 1 m/s along x
  belief::Control control;
  control.actions.push_back({0.04, belief::Release{"box"}});
  PredictOptions options = without_mode_changes();
  options.velocity_keep = options.unseen_velocity_keep = 1.0;
  run(belief, X_WG, 0.1, options, control);
  for (const Particle& particle : belief.objects[0].particles) {
    EXPECT_EQ(particle.mode, MotionMode::kMoving);
    EXPECT_NEAR(particle.V_WO.linear.x(), 1.0, 1e-9);
    EXPECT_NEAR(particle.X_WO.translation.x(), 0.2, 1e-9);
    EXPECT_GT(particle.covariance(9, 9), options.wake_speed * options.wake_speed);
  }
}

TEST_F(Predict, GraspedFollowsTheHandAndTheOldSceneKeepsItsWord) {
  belief::Belief belief = hand_and_object(MotionMode::kResting, false);
  const auto scene_before = belief.scene;
  belief::Control control;
  control.actions.push_back({0.0, belief::Grasp{"box", "hand"}});
  run(belief, Pose::from_translation({0.1, 0.0, 0.5}), 0.1, without_mode_changes(), control);
  EXPECT_FALSE(scene_before->objects[0].held_by.has_value());
  EXPECT_EQ(belief.scene->objects[0].held_by, "hand");
  EXPECT_NEAR(belief.objects[0].particles[0].X_WO.translation.z(), 0.4, 1e-9);
}

TEST_F(Predict, ReleasedIsHeldByNobody) {
  belief::Belief belief = hand_and_object(MotionMode::kHeld, true);
  const auto scene_before = belief.scene;
  belief::Control control;
  control.actions.push_back({0.04, belief::Release{"box"}});
  run(belief, Pose::from_translation({0.0, 0.0, 0.4}), 0.1, without_mode_changes(), control);
  EXPECT_EQ(scene_before->objects[0].held_by, "hand");
  EXPECT_FALSE(belief.scene->objects[0].held_by.has_value());
}

TEST_F(Predict, WhatIsLetGoAndGraspedAgainIsHeld) {
  belief::Belief belief = hand_and_object(MotionMode::kHeld, true);
  belief::Control control;
  control.actions.push_back({0.02, belief::Release{"box"}});
  control.actions.push_back({0.04, belief::Grasp{"box", "hand"}});
  run(belief, Pose::from_translation({0.0, 0.0, 0.4}), 0.1, without_mode_changes(), control);
  EXPECT_EQ(belief.scene->objects[0].held_by, "hand");
  EXPECT_EQ(belief.objects[0].particles[0].mode, MotionMode::kHeld);
}

TEST_F(Predict, AHandThatHasNotLetGoCarriesOnWhatSeemedToSlip) {
  PredictOptions options = without_mode_changes();
  options.regrasp_probability = 1.0;
  for (const bool held : {true, false}) {
    belief::Belief belief = hand_and_object(MotionMode::kMoving, held);
    run(belief, Pose::from_translation({0.0, 0.0, 0.4}), 0.1, options);
    for (const Particle& particle : belief.objects[0].particles)
      EXPECT_EQ(particle.mode, held ? MotionMode::kHeld : MotionMode::kMoving);
  }
}

TEST_F(Predict, SomeRestingParticlesWakeAndSlowOnesSettle) {
  belief::Belief resting = hand_and_object(MotionMode::kResting, false);
  belief::Belief moving = hand_and_object(MotionMode::kMoving, false);
  resting.objects[0].state = moving.objects[0].state = belief::TrackState::kTracked;
  int woken = 0, settled = 0;
  for (int i = 0; i < 50; ++i) {
    belief::Belief a = resting, b = moving;
    a.step = b.step = static_cast<std::uint64_t>(i);
    run(a, a.robot[0], 0.033, {});
    run(b, b.robot[0], 0.033, {});
    for (const Particle& particle : a.objects[0].particles) woken += particle.mode == MotionMode::kMoving;
    for (const Particle& particle : b.objects[0].particles) settled += particle.mode == MotionMode::kResting;
  }
  // 800 Bernoulli draws each; five standard deviations are 0.057 and 0.063.
  EXPECT_NEAR(woken / 800.0, 3.0 * PredictOptions().wake_probability, 0.058);
  EXPECT_NEAR(settled / 800.0, PredictOptions().settle_probability, 0.064);
}

}  // namespace
}  // namespace prescene::filter_tests
