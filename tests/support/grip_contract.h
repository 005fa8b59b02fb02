// SPDX-License-Identifier: Apache-2.0
// What every stepper does alike with tilts, hands that hold two things, blows, and grips that may slip: laws in closed
// form. Tests of a stepper include this and instantiate StepperContract.
#pragma once

#include <cmath>
#include <vector>

#include "tests/support/stepper_contract.h"

namespace prescene::tests {

TEST_P(StepperContract, ATiltTurnsTheHeldObjectAboutItsPivot) {
  Scene scene = held_scene();
  scene.robot[0].timeline.resize(1);
  belief::Tilt tilt;
  tilt.object = "object";
  tilt.axis_W = Vector3d::UnitY();
  tilt.angle = 0.5 * kPi;
  tilt.pivot_O = {0.05, 0.0, -0.05};
  const belief::ObjectState end = run_actions(scene, {{0.1, tilt}}, 1.5).final().objects[0];
  EXPECT_EQ(end.mode, MotionMode::kHeld);
  // The lower edge stays, and what was above it is beside it.
  EXPECT_LT((end.X_WO * tilt.pivot_O - Vector3d(0.05, 0.0, 0.45)).norm(), fine(1e-9));
  EXPECT_LT((end.X_WO.translation - Vector3d(0.10, 0.0, 0.50)).norm(), fine(1e-9));
}

// The tray has carried the block so slowly that it was calm all the while: when the tilt is over, it has not come to
// rest.
TEST_P(StepperContract, WhatSlidesDownATrayThatWasTiltedSlowlyIsNotAtRest) {
  const double angle = 20.0 * kPi / 180.0, over = 2.1, duration = 3.5;
  for (const double more : {-0.02, 0.02}) {
    ObjectModel tray = primitive_model("tray", BoxShape{{1.0, 1.0, 0.04}});
    ObjectModel block = primitive_model("block", BoxShape{{0.1, 0.1, 0.04}});
    tray.contact.friction = belief::FixedScalar{1.0};
    block.contact.friction = belief::FixedScalar{std::tan(angle) + more};
    Scene scene = floor_scene(tray);
    add_object(scene, block, "block");
    belief::KinematicBody hand;
    hand.name = "hand";
    hand.collision = {belief::PrimitiveShape{BoxShape{{0.1, 0.1, 0.02}}, Pose{}}};
    hand.timeline = {{0.0, Pose::from_translation({0.0, 0.0, 0.97})}};
    scene.robot.push_back(hand);
    scene.objects[0].pose = belief::FixedPose{Pose::from_translation({0.0, 0.0, 1.0})};
    scene.objects[0].held_by = "hand";
    scene.objects[1].pose = belief::FixedPose{Pose::from_translation({0.0, 0.0, 1.04})};
    belief::Tilt tilt;
    tilt.object = "object";
    tilt.axis_W = Vector3d::UnitY();
    tilt.angle = angle;
    tilt.duration = 2.0;
    const belief::Trajectory run = run_actions(scene, {{over - tilt.duration, tilt}}, duration);
    const std::vector<belief::ObjectState>& end = run.final().objects;
    const double way = (end[0].X_WO.inverse() * end[1].X_WO.translation - Vector3d(0.0, 0.0, 0.04)).norm();
    if (more < 0.0) {
      EXPECT_EQ(run.end, TrajectoryEnd::kDuration);
      // It has begun a little before, at the angle of its friction.
      EXPECT_GT(way, 0.5 * kG * std::cos(angle) * 0.02 * (duration - over) * (duration - over));
      EXPECT_LT(way, 0.5 * kG * std::cos(angle) * 0.02 * (duration - over + 0.15) * (duration - over + 0.15));
    } else {
      EXPECT_EQ(run.end, TrajectoryEnd::kAtRest);
      EXPECT_LT(run.final().time, over + 0.5);
      EXPECT_LT(way, 1e-3);
    }
  }
}

/// The hand of held_scene(), at rest, with a second object 0.3 m beside the first.
inline Scene two_held_scene() {
  Scene scene = held_scene();
  scene.robot[0].timeline.resize(1);
  belief::SceneObject other = scene.objects[0];
  other.name = "other";
  other.pose = belief::FixedPose{Pose::from_translation({0.0, 0.3, 0.5})};
  scene.objects.push_back(other);
  return scene;
}

// What a hand holds, it keeps as it holds it, though it is sent elsewhere with one thing while it carries the other.
TEST_P(StepperContract, AHandThatIsSentElsewhereTakesAllThatItHoldsThere) {
  const Vector3d between(0.0, 0.3, 0.0), goal(0.1, 0.6, 0.7);
  belief::Transport first{"object", belief::FixedPose{Pose::from_translation({0.2, 0.0, 0.5})}, 0.5};
  belief::Transport second{"other", belief::FixedPose{Pose::from_translation(goal)}, 0.5};
  for (const double longer : {0.0, 1.0}) {  // the first would end before the second, or after it
    first.duration = 0.5 + longer;
    const belief::Trajectory run = run_actions(two_held_scene(), {{0.25, first}, {0.5, second}}, 2.5, 0.05);
    for (const WorldState& state : run.states) {
      const Vector3d apart = state.objects[1].X_WO.translation - state.objects[0].X_WO.translation;
      EXPECT_LT((apart - between).norm(), fine(1e-9)) << longer << ' ' << state.time;
      EXPECT_EQ(state.objects[0].mode, MotionMode::kHeld);
    }
    EXPECT_LT((run.final().objects[1].X_WO.translation - goal).norm(), fine(1e-9)) << longer;
  }
}

// A thing that is put down on the way leaves the hand with its velocity, and the hand goes on.
TEST_P(StepperContract, AHandThatIsSentElsewhereLetsGoOfWhatItPutsDownAndGoesOn) {
  const belief::Place put{"object", belief::FixedPose{Pose::from_translation({0.2, 0.0, 0.5})}, 0.5};
  const belief::Transport second{"other", belief::FixedPose{Pose::from_translation({0.1, 0.6, 0.9})}, 0.5};
  const belief::Trajectory run = run_actions(two_held_scene(), {{0.25, put}, {0.5, second}}, 1.0);
  const std::vector<belief::ObjectState>& end = run.final().objects;
  EXPECT_EQ(end[0].mode, MotionMode::kMoving);
  const Vector3d fallen(0.0, 0.0, -0.5 * kG * 0.25 * 0.25);  // since 0.75 s
  EXPECT_LT((end[0].X_WO.translation - (end[1].X_WO.translation - Vector3d(0.0, 0.3, 0.0) + fallen)).norm(),
            fine(1e-6));
  EXPECT_LT((end[1].X_WO.translation - Vector3d(0.1, 0.6, 0.9)).norm(), fine(1e-9));
}

TEST_P(StepperContract, ABumpGivesItsMomentumAndTheMomentOfIt) {
  Scene scene = floor_scene(primitive_model("cube", BoxShape{{0.1, 0.1, 0.1}}, 2.0));
  scene.gravity_W.setZero();
  scene.objects[0].pose = belief::FixedPose{Pose::from_translation({0.0, 0.0, 0.5})};
  belief::Bump bump;
  bump.object = "object";
  bump.impulse = belief::Vector3Distribution::fixed({0.4, 0.0, 0.0});
  bump.point_O = Vector3d(-0.05, 0.02, 0.0);
  const belief::Trajectory run = run_actions(scene, {{0.2, bump}}, 0.7);
  const belief::ObjectState end = run.final().objects[0];
  EXPECT_LT((end.V_WO.linear - Vector3d(0.2, 0.0, 0.0)).norm(), fine(1e-9));
  // r x J = (0, 0, -0.02 * 0.4) over m a^2 / 6.
  EXPECT_LT((end.V_WO.angular - Vector3d(0.0, 0.0, -0.008 / (2.0 * 0.01 / 6.0))).norm(), 10.0 * fine(1e-9));
  EXPECT_NEAR(end.X_WO.translation.x(), 0.5 * 0.2, fine(1e-9) + 0.2 * 1.0 / 240.0);
}

TEST_P(StepperContract, ABumpWakesWhatRestsAndLeavesAloneWhatAHandHolds) {
  Scene scene = held_scene();
  scene.robot[0].timeline.resize(1);
  add_object(scene, primitive_model("rests", BoxShape{{0.1, 0.1, 0.1}}), "rests");
  scene.objects[1].pose = belief::FixedPose{Pose::from_translation({1.0, 0.0, 0.05})};
  std::vector<belief::Action> actions;
  for (const char* object : {"object", "rests"}) {
    belief::Bump bump;
    bump.object = object;
    bump.impulse = belief::Vector3Distribution::fixed({0.6, 0.0, 0.0});
    actions.push_back({1.0, bump});
  }
  const belief::WorldState end = run_actions(scene, actions, 3.0).final();
  EXPECT_LT((end.objects[0].X_WO.translation - Vector3d(0.0, 0.0, 0.5)).norm(), fine(1e-9));
  // Slides v^2 / 2 mu g.
  EXPECT_NEAR(end.objects[1].X_WO.translation.x(), 1.0 + 0.36 / (2.0 * 0.5 * kG), 0.004);
}

/// The box of held_scene(), 1 kg, that a grip of two fingers holds from `time` on by at most `limit` (N).
inline belief::Action grip_of(double time, double limit, double pad_length = 0.03) {
  belief::Grasp grasp{"object", "hand", belief::Grip{}};
  grasp.grip->force = belief::FixedScalar{limit};
  grasp.grip->friction = belief::FixedScalar{0.5};
  grasp.grip->pad_length = pad_length;
  return {time, grasp};
}

TEST_P(StepperContract, AGripHoldsWhatItsFrictionCarriesAndWhatIsHeavierSlidesOutAndFalls) {
  Scene scene = held_scene();
  scene.robot[0].timeline.resize(1);
  const Vector3d start(0.0, 0.0, 0.5);
  const belief::ObjectState held = run_actions(scene, {grip_of(0.0, 1.001 * kG)}, 1.0).final().objects[0];
  EXPECT_EQ(held.mode, MotionMode::kHeld);
  EXPECT_LT((held.X_WO.translation - start).norm(), fine(1e-9));
  // It slides with what the friction leaves of gravity.
  const double excess = 0.2;
  const belief::ObjectState slid = run_actions(scene, {grip_of(0.0, kG - excess)}, 0.5).final().objects[0];
  EXPECT_EQ(slid.mode, MotionMode::kMoving);
  EXPECT_NEAR(slid.X_WO.translation.z(), 0.5 - 0.5 * excess * 0.25, 2e-4);
  EXPECT_NEAR(slid.V_WO.linear.z(), -excess * 0.5, 2e-3);
  // Out of the pads it falls freely: v^2 = 2 (excess * pad + g * rest).
  const belief::Trajectory fallen = run_actions(scene, {grip_of(0.0, 0.5 * kG, 0.02)}, 3.0);
  EXPECT_EQ(fallen.end, TrajectoryEnd::kAtRest);
  EXPECT_NEAR(fallen.final().objects[0].X_WO.translation.z(), 0.05, 1e-3);
  double first = 0.0;
  for (const belief::ContactInterval& contact : fallen.contacts)
    if (contact.second == 1 && first == 0.0) first = contact.begin;
  const double leaves = std::sqrt(2.0 * 0.02 / (0.5 * kG)), speed = 0.5 * kG * leaves;
  const double lands = leaves + (std::sqrt(speed * speed + 2.0 * kG * (0.45 - 0.02)) - speed) / kG;
  EXPECT_NEAR(first, lands, 0.01);
}

TEST_P(StepperContract, AGripSlipsOnceTheHandAcceleratesTooMuch) {
  Scene scene = held_scene();
  const double acceleration = 3.0, step = simulation::MechanicsOptions{}.step;
  belief::KinematicBody& hand = scene.robot[0];
  const double height = hand.timeline[0].X_WG.translation.z();
  hand.timeline.clear();
  for (int i = 0; i <= 60; ++i) {
    const double t = i * step;
    hand.timeline.push_back({t, Pose::from_translation({0.0, 0.0, height + 0.5 * acceleration * t * t})});
  }
  for (const double share : {0.99, 1.01}) {
    const double limit = share * (kG + acceleration);
    const belief::ObjectState end = run_actions(scene, {grip_of(0.0, limit)}, 0.25).final().objects[0];
    const double lag = 0.5 + 0.5 * acceleration * 0.0625 - end.X_WO.translation.z();
    if (share > 1.0) {
      EXPECT_EQ(end.mode, MotionMode::kHeld);
      EXPECT_NEAR(lag, 0.0, fine(1e-6));
    } else {
      EXPECT_EQ(end.mode, MotionMode::kMoving);
      // The hand's velocity is that of a step's chord, which is half a step behind.
      EXPECT_NEAR(lag, 0.5 * 0.01 * (kG + acceleration) * 0.0625, 0.5 * acceleration * step * 0.25 + 3e-4);
    }
  }
}

TEST_P(StepperContract, WhatSlidesInAGripThatStopsSticksAgainOrLeavesIt) {
  Scene scene = held_scene();
  scene.gravity_W.setZero();
  scene.robot[0].timeline[1] = {1.0, Pose::from_translation({0.5, 0.0, 0.558})};
  // The hand of 0.5 m/s stops at 1 s: v^2 m / 2 L is the way on.
  const belief::ObjectState sticks = run_actions(scene, {grip_of(0.5, 10.0)}, 1.5).final().objects[0];
  EXPECT_EQ(sticks.mode, MotionMode::kHeld);
  EXPECT_NEAR(sticks.X_WO.translation.x(), 0.5 + 0.0125, 1.5e-3);
  const belief::ObjectState leaves = run_actions(scene, {grip_of(0.5, 2.0)}, 1.5).final().objects[0];
  EXPECT_EQ(leaves.mode, MotionMode::kMoving);
  EXPECT_NEAR(leaves.V_WO.linear.x(), std::sqrt(0.25 - 2.0 * 2.0 * 0.03), 0.01);
}

TEST_P(StepperContract, ABlowLoosensAGrip) {
  Scene scene = held_scene();
  scene.gravity_W.setZero();
  scene.robot[0].timeline.resize(1);
  belief::Bump bump;
  bump.object = "object";
  bump.impulse = belief::Vector3Distribution::fixed({0.0, 0.0, -0.4});
  const belief::ObjectState end = run_actions(scene, {grip_of(0.0, 10.0), {0.2, bump}}, 1.0).final().objects[0];
  EXPECT_EQ(end.mode, MotionMode::kHeld);
  EXPECT_NEAR(end.X_WO.translation.z(), 0.5 - 0.16 / 20.0, 1e-3);
}

TEST_P(StepperContract, AsManyGripsSlipAsTheirFrictionSays) {
  Scene scene = held_scene();
  scene.robot[0].timeline.resize(1);
  belief::Grasp grasp{"object", "hand", belief::Grip{}};
  grasp.grip->force = belief::FixedScalar{10.0};
  grasp.grip->friction = belief::NormalScalar{0.5, 0.1, 0.0};
  simulation::RunRequest request;
  request.actions = {{0.0, grasp}};
  request.stop.duration = 0.03;
  constexpr int kInstances = 2000;
  const std::vector<WorldState> starts(kInstances, start_of(scene));
  std::vector<belief::Trajectory> runs(starts.size());
  core::ThreadPool pool(1);
  simulator_of(scene)->run(starts, request, core::RandomStream(7, core::Purpose::kTest), 0, pool, runs);
  int slipped = 0;
  for (const belief::Trajectory& run : runs) slipped += run.final().objects[0].mode != MotionMode::kHeld ? 1 : 0;
  // 2 mu F < m g for mu < 0.4905; four standard errors.
  const double expected = 0.5 * std::erfc((0.5 - 0.05 * kG) / 0.1 / std::sqrt(2.0));
  EXPECT_NEAR(slipped / static_cast<double>(kInstances), expected,
              4.0 * std::sqrt(expected * (1.0 - expected) / kInstances));
}

TEST_P(StepperContract, AGripWithoutAFrictionOfItsOwnHasThatOfTheSurfaces) {
  Scene scene = held_scene();  // of the box: 0.5
  scene.robot[0].timeline.resize(1);
  scene.robot[0].contact.friction = belief::FixedScalar{0.8};
  for (const double force : {12.0, 12.5}) {  // m g / 2 / 0.4 = 12.26
    belief::Grasp grasp{"object", "hand", belief::Grip{}};
    grasp.grip->force = belief::FixedScalar{force};
    const belief::ObjectState end = run_actions(scene, {{0.0, grasp}}, 0.1).final().objects[0];
    EXPECT_EQ(end.mode == MotionMode::kHeld, force > 12.26) << force;
  }
}

TEST_P(StepperContract, ASlidThingIsPlacedWhereItSlidToAndALostOneIsNot) {
  Scene scene = held_scene();
  scene.robot[0].timeline.resize(1);
  belief::Bump bump;
  bump.object = "object";
  bump.impulse = belief::Vector3Distribution::fixed({0.0, 0.0, -0.4});
  belief::Transport transport;
  transport.object = "object";
  transport.X_WO = belief::FixedPose{Pose::from_translation({0.0, 0.2, 0.5})};
  scene.gravity_W.setZero();
  const belief::Trajectory slid = run_actions(scene, {grip_of(0.0, 10.0), {0.2, bump}, {0.5, transport}}, 2.0);
  const Vector3d end = slid.final().objects[0].X_WO.translation;
  EXPECT_NEAR(end.z(), 0.5 - 0.008, 1e-3);
  EXPECT_NEAR(end.y(), 0.2, 3e-3);
  bump.impulse = belief::Vector3Distribution::fixed({0.0, 0.0, -2.0});
  const belief::Trajectory lost = run_actions(scene, {grip_of(0.0, 10.0), {0.2, bump}, {0.5, transport}}, 0.8);
  EXPECT_LT(lost.final().objects[0].X_WO.translation.y(), 1e-3);
}

}  // namespace prescene::tests
