// SPDX-License-Identifier: Apache-2.0
// Objects that are at rest while others move are not computed (simulation/lockstep/lane_sleep.cc): nobody may notice.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "lockstep_scenes.h"
#include "tests/support/hollow_meshes.h"

namespace prescene::tests::sleeping_test {
namespace {

using geometry::BoxShape;
using geometry::Sphere;

constexpr double kStep = 1.0 / 240.0;

/// A ball that rolls towards a box, and reaches it so many steps later.
Scene ball_and_box(const belief::CollisionShape& box) {
  Scene scene;
  scene.name = "ball_and_box";
  scene.supports.push_back(floor_support());
  add_object(scene, model_of("box", {box}, 0.3), "box");
  ObjectModel ball = primitive_model("ball", Sphere{0.02}, 0.2);
  ball.contact.restitution = belief::FixedScalar{0.5};
  add_object(scene, ball, "ball");
  return scene;
}
WorldState rolling_from(const Scene& scene, int steps) {
  constexpr double kSpeed = 0.6;
  WorldState start = start_of(scene);
  start.objects[0].X_WO.translation = {0.05, 0.0, 0.03};
  start.objects[1].X_WO.translation = {-0.02 - kSpeed * kStep * steps, 0.0, 0.02};
  start.objects[1].V_WO.linear = {kSpeed, 0.0, 0.0};
  start.objects[1].V_WO.angular = {0.0, kSpeed / 0.02, 0.0};
  return start;
}

TEST(Sleeping, WhatSleptIsStruckAsIfItHadNot) {
  const BoxShape size{{0.06, 0.06, 0.06}};
  for (const belief::CollisionShape& shape :
       {belief::CollisionShape(belief::PrimitiveShape{size, Pose{}}),
        belief::CollisionShape(spheres_of(geometry::make_mesh(size), {800, 0.0}))}) {
    const Scene scene = ball_and_box(shape);
    const auto struck = [&](int steps, bool rested) {
      auto instance = lockstep_instance_of(scene);
      instance->set_state(rolling_from(scene, steps));
      for (int n = 0; n < steps - 4; ++n) instance->step();
      EXPECT_EQ(instance->state().objects[0].mode == belief::MotionMode::kResting, rested) << steps;
      for (int n = 0; n < 20; ++n) instance->step();
      return instance->state();
    };
    const WorldState awake = struck(24, false), woken = struck(144, true);
    for (std::size_t i = 0; i < 2; ++i) {
      const belief::ObjectState &a = awake.objects[i], &b = woken.objects[i];
      EXPECT_LT((a.V_WO.linear - b.V_WO.linear).norm(), 2e-3) << i;
      EXPECT_LT((a.X_WO.translation - b.X_WO.translation).norm(), 2e-4) << i;
    }
    EXPECT_GT(awake.objects[0].V_WO.linear.x(), 0.1);
  }
}

TEST(Sleeping, LeavesNoGapInAContact) {
  Scene scene = ball_and_box(belief::PrimitiveShape{BoxShape{{0.06, 0.06, 0.06}}, Pose{}});
  WorldState start = rolling_from(scene, 24);
  // Far from the box a ball bounces for a second.
  start.objects[1].X_WO.translation = {-0.5, 0.0, 0.4};
  start.objects[1].V_WO = {};
  scene.models[1].contact.restitution = belief::FixedScalar{0.8};
  start.objects[1].physical.restitution = 0.8;
  scene.models[1].contact.rolling_friction = 1e-3;
  simulation::RunRequest request;
  request.stop.duration = 5.0;
  request.sample_interval = kStep;
  const belief::Trajectory run = run_all(*lockstep_of(scene), {start}, request)[0];
  ASSERT_EQ(run.end, belief::TrajectoryEnd::kAtRest);
  ASSERT_GT(run.simulated_seconds, 1.0);
  std::vector<belief::ContactInterval> of_box;
  for (const belief::ContactInterval& contact : run.contacts)
    if (contact.first == 0 || contact.second == 0) of_box.push_back(contact);
  ASSERT_EQ(of_box.size(), 1U);
  EXPECT_EQ(of_box[0].begin, 0.0);
  EXPECT_NEAR(of_box[0].end, run.simulated_seconds, 1e-9);
  EXPECT_NEAR(of_box[0].normal_z, 1.0, 1e-6);
  EXPECT_EQ(run.final_contacts.size(), 2U);
  // And it neither moved nor forgot what it stands on.
  const belief::WorldState& end = run.final();
  EXPECT_LT((end.objects[0].X_WO.translation - start.objects[0].X_WO.translation).norm(), 1e-5);
  EXPECT_EQ(end.objects[0].mode, belief::MotionMode::kResting);
}

TEST(Sleeping, ABallDroppedIntoACupThatSleptStaysIn) {
  Scene scene;
  scene.name = "ball_in_cup";
  scene.supports.push_back(floor_support());
  add_object(scene, model_of("cup", {spheres_of(cup(0.04, 0.09, 0.003), {1000, 0.0})}, 0.3), "cup");
  ObjectModel ball = primitive_model("ball", Sphere{0.012}, 0.02);
  ball.contact.restitution = belief::FixedScalar{0.3};
  ball.contact.rolling_friction = 3e-4;
  add_object(scene, ball, "ball");
  core::RandomStream stream(21, core::Purpose::kTest);
  std::vector<WorldState> starts;
  for (int i = 0; i < 16; ++i) {
    WorldState start = start_of(scene);
    start.objects[0].X_WO.translation = {0.0, 0.0, 0.0};
    const double angle = stream.uniform(0.0, 2.0 * kPi), off = stream.uniform(0.0, 0.02);
    // It falls for 0.3 s: the cup sleeps by then. Sideways it has too little speed to climb out.
    start.objects[1].X_WO.translation = {off * std::cos(angle), off * std::sin(angle), 0.5};
    starts.push_back(start);
  }
  simulation::RunRequest request;
  request.stop.duration = 6.0;
  request.sample_interval = kStep;
  for (const belief::Trajectory& run : run_all(*lockstep_of(scene), starts, request)) {
    EXPECT_EQ(run.end, belief::TrajectoryEnd::kAtRest);
    bool was_in = false;
    for (const WorldState& state : run.states) {
      const Vector3d p = state.objects[0].X_WO.inverse() * state.objects[1].X_WO.translation;
      was_in = was_in || p.z() < 0.06;
      if (!was_in) continue;
      ASSERT_LT(p.z(), 0.09) << state.time;
      ASSERT_GT(p.z(), 0.003 + 0.012 - 1.5e-3) << state.time;
      ASSERT_LT(p.head<2>().norm(), 0.04 - 0.003 - 0.012 + 1e-3) << state.time;
    }
    EXPECT_TRUE(was_in);
  }
}

}  // namespace
}  // namespace prescene::tests::sleeping_test
