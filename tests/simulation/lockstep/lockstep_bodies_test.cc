// SPDX-License-Identifier: Apache-2.0
// Several objects in lockstep, and surroundings that move, against closed-form mechanics.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "lockstep_scenes.h"

namespace prescene::tests {
namespace {

using geometry::BoxShape;
using geometry::Sphere;

TEST(LockstepBodies, ObjectsThatMeetKeepTheirMomentumAndBounceAsSet) {
  for (const double e : {0.0, 0.5, 0.9}) {
    Scene scene;
    scene.name = "air";
    scene.gravity_W.setZero();
    for (const double mass : {0.3, 1.1}) {
      ObjectModel ball = primitive_model("ball" + std::to_string(mass), Sphere{0.05}, mass);
      ball.contact.restitution = belief::FixedScalar{std::sqrt(e)};
      ball.contact.friction = belief::FixedScalar{0.4};
      add_object(scene, ball, ball.name);
    }
    WorldState start = start_of(scene);
    // Off centre, so that they rub and turn; and with spin.
    start.objects[0].X_WO.translation = {-0.2, 0.01, 0.0};
    start.objects[0].V_WO.linear = {2.0, 0.0, 0.0};
    start.objects[1].V_WO.linear = {-0.5, 0.1, 0.0};
    start.objects[1].V_WO.angular = {0.0, 0.0, 3.0};
    const auto momentum = [&](const WorldState& state) {
      return Vector3d(0.3 * state.objects[0].V_WO.linear + 1.1 * state.objects[1].V_WO.linear);
    };
    const auto turning = [&](const WorldState& state) {
      Vector3d sum = Vector3d::Zero();
      for (std::size_t i = 0; i < 2; ++i) {
        const belief::ObjectState& o = state.objects[i];
        sum += o.physical.mass * (o.X_WO.translation.cross(o.V_WO.linear) + 0.4 * 0.05 * 0.05 * o.V_WO.angular);
      }
      return sum;
    };
    auto instance = lockstep_instance_of(scene);
    instance->set_state(start);
    WorldState before = start;
    const auto apart = [](const WorldState& s) {
      return (s.objects[1].X_WO.translation - s.objects[0].X_WO.translation).norm();
    };
    step_for(*instance, 0.2);
    const WorldState after = instance->state();
    ASSERT_GT(apart(after), 0.1);
    EXPECT_LT((momentum(after) - momentum(before)).norm(), 1e-6);
    EXPECT_LT((turning(after) - turning(before)).norm(), 1e-4);
    // Along the line of centres at the impact, which is where the change of velocity without rubbing points; slow
    // enough turning leaves it within what the offset allows.
    const Vector3d closing = before.objects[1].V_WO.linear - before.objects[0].V_WO.linear;
    const Vector3d leaving = after.objects[1].V_WO.linear - after.objects[0].V_WO.linear;
    const double offset = 0.01 / 0.1;  // sine between the line of centres and the way, about
    EXPECT_NEAR(leaving.x() / -closing.x(), e, 1.5 * offset * offset + 0.06) << e;
  }
}

TEST(LockstepBodies, StackOfFourBoxesStaysForTenSeconds) {
  Scene scene;
  scene.name = "stack";
  scene.supports.push_back(floor_support());
  for (int i = 0; i < 4; ++i) {
    add_object(scene, primitive_model("box" + std::to_string(i), BoxShape{{0.1, 0.1, 0.1}}), std::to_string(i));
  }
  // Upside down, too: the first of two objects is once the upper, once the lower one.
  for (const bool reversed : {false, true}) {
    auto instance = lockstep_instance_of(scene);
    WorldState start = start_of(scene);
    for (int i = 0; i < 4; ++i) {
      start.objects[static_cast<std::size_t>(i)].X_WO.translation = {0.0, 0.0, 0.05 + 0.1 * (reversed ? 3 - i : i)};
    }
    instance->set_state(start);
    step_for(*instance, 10.0);
    const WorldState end = instance->state();
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_LT((end.objects[i].X_WO.translation - start.objects[i].X_WO.translation).norm(), 1e-3);
      EXPECT_LT(geometry::angle_between(end.objects[i].X_WO.rotation, start.objects[i].X_WO.rotation), 2e-3);
    }
    EXPECT_TRUE(instance->at_rest());
  }
}

TEST(LockstepBodies, StackIsAtRestAndItsOverhangingTopIsNot) {
  for (const double overhang : {0.04, 0.0498}) {
    Scene scene;
    scene.name = "stack";
    scene.supports.push_back(floor_support());
    for (const char* name : {"lower", "upper"}) {
      add_object(scene, primitive_model(name, BoxShape{{0.1, 0.1, 0.1}}), name);
    }
    WorldState start = start_of(scene);
    start.objects[0].X_WO.translation = {0.0, 0.0, 0.05};
    start.objects[1].X_WO.translation = {overhang, 0.0, 0.15};
    simulation::RunRequest request;
    request.stop.duration = 0.6;
    const belief::Trajectory run = run_one(*lockstep_of(scene), start, request);
    EXPECT_EQ(run.end == belief::TrajectoryEnd::kAtRest, overhang < 0.045) << overhang;
  }
}

/// What a pair's bounce makes of the gravity that only one of the two falls with.
TEST(LockstepBodies, WhatLandsOnALyingThingComesToRest) {
  for (const double e : {0.1, 0.3, 0.6}) {
    Scene scene;
    scene.name = "landing";
    scene.supports.push_back(floor_support());
    for (const char* name : {"upper", "lower"}) {
      ObjectModel model = primitive_model(name, BoxShape{{0.1, 0.1, 0.1}});
      model.contact.restitution = belief::FixedScalar{std::sqrt(e)};
      add_object(scene, model, name);
    }
    WorldState start = start_of(scene);
    start.objects[0].X_WO.translation = {0.0, 0.0, 0.151};
    start.objects[1].X_WO.translation = {0.0, 0.0, 0.05};
    simulation::RunRequest request;
    request.stop.duration = 3.0;
    const belief::Trajectory run = run_one(*lockstep_of(scene), start, request);
    EXPECT_EQ(run.end, belief::TrajectoryEnd::kAtRest) << e;
    EXPECT_NEAR(run.final().objects[0].X_WO.translation.z(), 0.15, 1e-4);
  }
}

TEST(LockstepBodies, BallReboundsFromALyingSlabAsFromTheFloor) {
  for (const double e : {0.5, 0.8}) {
    double worst = 0.0;
    for (int phase = 0; phase < 16; ++phase) {
      Scene scene;
      scene.name = "slab";
      scene.supports.push_back(floor_support());
      ObjectModel ball = primitive_model("ball", Sphere{0.03}, 0.1);
      ball.contact.restitution = belief::FixedScalar{e};
      add_object(scene, ball, "ball");
      ObjectModel slab = primitive_model("slab", BoxShape{{0.4, 0.4, 0.1}}, 5.0);
      slab.contact.restitution = belief::FixedScalar{1.0};
      add_object(scene, slab, "slab");
      LockstepOptions options;
      options.step = 1e-3;
      auto instance = lockstep_instance_of(scene, options);
      const double fall = 0.3 + 0.0007 * phase;
      WorldState start = start_of(scene);
      start.objects[0].X_WO.translation = {0.0, 0.0, 0.13 + fall};
      start.objects[1].X_WO.translation = {0.0, 0.0, 0.05};
      instance->set_state(start);
      double top = 0.0;
      for (bool rising = false; !rising || instance->state().objects[0].V_WO.linear.z() > 0.0;) {
        instance->step();
        const belief::ObjectState o = instance->state().objects[0];
        rising = rising || o.V_WO.linear.z() > 0.0;
        if (rising) top = std::max(top, o.X_WO.translation.z() - 0.13);
        ASSERT_LT(instance->state().time, 2.0);
      }
      worst = std::max(worst, std::abs(top / (e * e * fall) - 1.0));
    }
    EXPECT_LT(worst, 0.04) << e;
  }
}

/// A plate that speeds up along x, then keeps its speed.
Scene plate_scene(const belief::ObjectModel& model, double acceleration, double until) {
  Scene scene;
  scene.name = "plate";
  belief::KinematicBody plate;
  plate.name = "plate";
  plate.collision = {belief::PrimitiveShape{BoxShape{{6.0, 6.0, 0.1}}, Pose{}}};
  plate.contact.friction = belief::FixedScalar{1.0};
  const int pieces = static_cast<int>(std::lround(until * 240.0));
  for (int i = 0; i <= pieces; ++i) {
    const double t = until * i / pieces;
    plate.timeline.push_back({t, Pose::from_translation({0.5 * acceleration * t * t, 0.0, -0.05})});
  }
  scene.robot.push_back(plate);
  add_object(scene, model, "object");
  return scene;
}

TEST(LockstepBodies, AMovingPlateCarriesOrSlipsAsItsAccelerationSays) {
  const double mu = 0.3;
  ObjectModel block = primitive_model("block", BoxShape{{0.1, 0.1, 0.04}});
  block.contact.friction = belief::FixedScalar{mu};
  for (const double share : {0.9, 1.3}) {
    const double acceleration = share * mu * kG;
    auto instance = lockstep_instance_of(plate_scene(block, acceleration, 0.5));
    WorldState start = instance->state();
    start.objects[0].X_WO.translation = {0.0, 0.0, 0.02};
    instance->set_state(start);
    step_for(*instance, 0.5);
    const double speed = std::min(acceleration, mu * kG) * 0.5;
    EXPECT_NEAR(instance->state().objects[0].V_WO.linear.x(), speed, 0.02 * speed) << share;
    EXPECT_NEAR(instance->state().objects[0].X_WO.translation.z(), 0.02, 1e-4);
  }
}

TEST(LockstepBodies, AMovingPlateSetsABallRolling) {
  // Friction F gives it a = F / m and a spin of F / (2/5 m R); rolling on the plate, 2/7 of the plate's acceleration.
  ObjectModel ball = primitive_model("ball", Sphere{0.04});
  ball.contact.friction = belief::FixedScalar{0.8};
  const double acceleration = 2.0;
  auto instance = lockstep_instance_of(plate_scene(ball, acceleration, 0.5));
  WorldState start = instance->state();
  start.objects[0].X_WO.translation = {0.0, 0.0, 0.04};
  instance->set_state(start);
  step_for(*instance, 0.5);
  const double speed = 2.0 / 7.0 * acceleration * 0.5;
  EXPECT_NEAR(instance->state().objects[0].V_WO.linear.x(), speed, 0.02 * speed);
}

}  // namespace
}  // namespace prescene::tests
