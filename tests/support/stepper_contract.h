// SPDX-License-Identifier: Apache-2.0
// What every stepper does alike: actions (holding, releasing, placing, pushing, pouring, grasping, carrying), contacts
// and how runs end. A stepper's tests include this and instantiate StepperContract with it.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

#include "prescene/belief/outcome.h"
#include "prescene/simulation/rules/mechanics_options.h"
#include "tests/support/closed_forms.h"
#include "tests/support/simple_scenes.h"

namespace prescene::tests {

struct Stepper {
  std::string name;
  std::function<std::unique_ptr<simulation::Simulator>(const Scene&, const simulation::MechanicsOptions&)> make;
  double precision;  ///< m and m/s: as close as it gets to what is exact.

  friend void PrintTo(const Stepper& stepper, std::ostream* out) { *out << stepper.name; }
};

class StepperContract : public testing::TestWithParam<Stepper> {
 protected:
  std::unique_ptr<simulation::Simulator> simulator_of(const Scene& scene,
                                                      const simulation::MechanicsOptions& options = {}) const {
    return GetParam().make(scene, options);
  }
  /// An error that exact arithmetic would not exceed.
  double fine(double error) const { return std::max(error, GetParam().precision); }
  belief::Trajectory run_actions(const Scene& scene, std::vector<belief::Action> actions, double duration,
                                 double sample_interval = 0.0) const {
    simulation::RunRequest request;
    request.actions = std::move(actions);
    request.stop.duration = duration;
    request.sample_interval = sample_interval;
    return run_one(*simulator_of(scene), start_of(scene), request);
  }
};

using belief::MotionMode;
using belief::TrajectoryEnd;
using geometry::BoxShape;

/// A hand (a plate above the object, overlapping it by 2 mm) that moves along x at 0.5 m/s for two seconds.
inline Scene held_scene() {
  Scene scene = floor_scene(primitive_model("box", BoxShape{{0.1, 0.1, 0.1}}));
  belief::KinematicBody hand;
  hand.name = "hand";
  hand.collision = {belief::PrimitiveShape{BoxShape{{0.12, 0.12, 0.02}}, Pose{}}};
  hand.timeline = {{0.0, Pose::from_translation({0.0, 0.0, 0.558})}, {2.0, Pose::from_translation({1.0, 0.0, 0.558})}};
  scene.robot.push_back(hand);
  scene.objects[0].pose = belief::FixedPose{Pose::from_translation({0.0, 0.0, 0.5})};
  scene.objects[0].held_by = "hand";
  return scene;
}

inline belief::Release release_of(const std::string& object) {
  belief::Release release;
  release.object = object;
  release.retreat = {0.0, 0.0, 0.1};
  release.retreat_duration = 0.1;
  return release;
}

TEST_P(StepperContract, HeldObjectMovesWithItsHand) {
  const belief::Trajectory run = run_actions(held_scene(), {}, 1.0);
  const belief::ObjectState end = run.final().objects[0];
  EXPECT_EQ(end.mode, MotionMode::kHeld);
  EXPECT_LT((end.X_WO.translation - Vector3d(0.5, 0.0, 0.5)).norm(), fine(1e-9));
  EXPECT_LT((end.V_WO.linear - Vector3d(0.5, 0.0, 0.0)).norm(), fine(1e-9));
  EXPECT_TRUE(run.contacts.empty());
}

TEST_P(StepperContract, ReleasedObjectLeavesWithTheHandsVelocityAndIsNotThrownByTheGrip) {
  const belief::Trajectory run = run_actions(held_scene(), {{0.5, release_of("object")}}, 0.75);
  const belief::ObjectState end = run.final().objects[0];
  const double fall = 0.25;
  EXPECT_EQ(end.mode, MotionMode::kMoving);
  EXPECT_LT((end.X_WO.translation - Vector3d(0.375, 0.0, 0.5 - 0.5 * kG * fall * fall)).norm(), fine(1e-6));
  EXPECT_LT((end.V_WO.linear - Vector3d(0.5, 0.0, -kG * fall)).norm(), fine(1e-9));
}

TEST_P(StepperContract, DisturbanceOfAReleaseIsAddedToTheVelocity) {
  belief::Release release = release_of("object");
  release.disturbance.linear.y = belief::FixedScalar{0.2};
  release.disturbance.angular.z = belief::FixedScalar{1.5};
  const belief::Trajectory run = run_actions(held_scene(), {{0.5, release}}, 0.75);
  const belief::ObjectState end = run.final().objects[0];
  EXPECT_NEAR(end.X_WO.translation.y(), 0.2 * 0.25, fine(1e-6));
  EXPECT_LT(geometry::angle_between(end.X_WO.rotation, about(Vector3d::UnitZ(), 1.5 * 0.25)), fine(1e-6));
}

TEST_P(StepperContract, HandThatHasStoppedReleasesAtRest) {
  const belief::Trajectory run = run_actions(held_scene(), {{2.0, release_of("object")}}, 4.0);
  EXPECT_EQ(run.end, TrajectoryEnd::kAtRest);
  EXPECT_LT((run.final().objects[0].X_WO.translation - Vector3d(1.0, 0.0, 0.05)).norm(), 1e-3);
  EXPECT_EQ(run.final().objects[0].mode, MotionMode::kResting);
}

TEST_P(StepperContract, PlacedObjectEndsWhereItWasPut) {
  belief::Place place;
  place.object = "object";
  const Pose goal{about(Vector3d::UnitZ(), 0.5), {0.3, 0.2, 0.05}};
  place.X_WO = belief::FixedPose{goal};
  place.duration = 0.5;
  const belief::Trajectory run = run_actions(held_scene(), {{0.25, place}}, 3.0, 0.1);
  EXPECT_EQ(run.end, TrajectoryEnd::kAtRest);
  EXPECT_LT((run.final().objects[0].X_WO.translation - goal.translation).norm(), 1e-4);
  EXPECT_LT(geometry::angle_between(run.final().objects[0].X_WO.rotation, goal.rotation), 1e-3);
  // Half way it is half way.
  for (const WorldState& state : run.states) {
    if (std::abs(state.time - 0.5) > 1e-6) continue;
    EXPECT_LT((state.objects[0].X_WO.translation - 0.5 * (Vector3d(0.125, 0, 0.5) + goal.translation)).norm(), 5e-3);
  }
}

TEST_P(StepperContract, PoseErrorsOfPlacingAreDrawnPerInstance) {
  const Scene scene = held_scene();
  belief::Place place;
  place.object = "object";
  belief::BoxPose goal;
  goal.position = {belief::UniformScalar{0.0, 0.4}, belief::FixedScalar{0.0}, belief::FixedScalar{0.05}};
  place.X_WO = goal;
  simulation::RunRequest request;
  request.actions = {{0.0, place}};
  const std::vector<WorldState> starts(20, start_of(scene));
  std::vector<belief::Trajectory> runs(starts.size());
  core::ThreadPool pool(1);
  simulator_of(scene)->run(starts, request, core::RandomStream(3, core::Purpose::kAction), 0, pool, runs);
  double low = 1.0;
  double high = 0.0;
  for (const belief::Trajectory& run : runs) {
    low = std::min(low, run.final().objects[0].X_WO.translation.x());
    high = std::max(high, run.final().objects[0].X_WO.translation.x());
  }
  EXPECT_LT(low, 0.1);
  EXPECT_GT(high, 0.3);

  // Some of them alone, by their numbers, end as they did among all.
  const std::vector<std::uint32_t> some = {17, 3, 4};
  std::vector<belief::Trajectory> again(some.size());
  simulator_of(scene)->run(std::span(starts).first(some.size()), request, core::RandomStream(3, core::Purpose::kAction),
                           std::span(some), pool, again);
  for (std::size_t i = 0; i < some.size(); ++i)
    EXPECT_EQ(again[i].final().objects[0].X_WO.translation, runs[some[i]].final().objects[0].X_WO.translation);
}

TEST_P(StepperContract, PusherPushesAndIsNumberedAfterAllOthers) {
  Scene scene = held_scene();
  scene.objects[0].held_by.reset();
  scene.objects[0].pose = belief::FixedPose{Pose::from_translation({0.0, 0.0, 0.05})};
  belief::Push push;
  push.from = {-0.2, 0.0, 0.05};
  push.to = {0.1, 0.0, 0.05};
  push.radius = 0.02;
  const belief::Trajectory run = run_actions(scene, {{0.1, push}}, 3.0);
  const double x = run.final().objects[0].X_WO.translation.x();
  EXPECT_NEAR(x, 0.17, 0.02);  // face where the finger's tip stopped, or a little on
  const auto touched = [&](int other) {
    for (const belief::ContactInterval& c : run.contacts) {
      if (c.first == 0 && c.second == other) return true;
    }
    return false;
  };
  EXPECT_TRUE(touched(3));  // object 0, floor 1, hand 2, pusher 3
  EXPECT_FALSE(touched(2));
}

TEST_P(StepperContract, LateralErrorShiftsThePushToItsLeft) {
  Scene scene = floor_scene(primitive_model("ball", geometry::Sphere{0.05}));
  scene.objects[0].pose = belief::FixedPose{Pose::from_translation({0.0, 0.0, 0.05})};
  belief::Push push;
  push.from = {-0.2, 0.0, 0.05};
  push.to = {0.2, 0.0, 0.05};
  push.lateral_error = belief::FixedScalar{0.02};
  const belief::Trajectory run = run_actions(scene, {{0.0, push}}, 1.0);
  // Pushed on its left side (+y), the ball leaves to the right.
  EXPECT_LT(run.final().objects[0].X_WO.translation.y(), -0.01);
}

TEST_P(StepperContract, PourTurnsGraspTakesAndTransportCarries) {
  Scene scene = held_scene();
  scene.objects[0].held_by.reset();
  scene.objects[0].pose = belief::FixedPose{Pose::from_translation({0.0, 0.0, 0.05})};
  scene.robot[0].timeline = {{0.0, Pose::from_translation({0.0, 0.0, 0.11})}};
  belief::Transport transport;
  transport.object = "object";
  transport.X_WO = belief::FixedPose{Pose::from_translation({0.2, 0.1, 0.4})};
  belief::Pour pour;
  pour.container = "object";
  pour.axis_W = Vector3d::UnitX();
  pour.angle = 2.0;
  const belief::Trajectory run =
      run_actions(scene, {{0.5, belief::Grasp{"object", "hand"}}, {0.6, transport}, {1.7, pour}}, 4.0);
  const belief::ObjectState end = run.final().objects[0];
  EXPECT_EQ(end.mode, MotionMode::kHeld);
  EXPECT_LT((end.X_WO.translation - Vector3d(0.2, 0.1, 0.4)).norm(), fine(1e-9));
  EXPECT_LT(geometry::angle_between(end.X_WO.rotation, about(Vector3d::UnitX(), 2.0)), fine(1e-6));
}

TEST_P(StepperContract, HeldObjectsPushOthers) {
  Scene scene = held_scene();
  scene.supports.clear();
  scene.gravity_W.setZero();
  add_object(scene, primitive_model("free", geometry::Sphere{0.05}), "free");
  scene.objects[1].pose = belief::FixedPose{Pose::from_translation({0.3, 0.0, 0.5})};
  const belief::Trajectory run = run_actions(scene, {}, 1.0);
  EXPECT_GE(run.final().objects[1].X_WO.translation.x(), 0.6 - 1e-3);
  ASSERT_FALSE(run.contacts.empty());
  EXPECT_EQ(run.contacts[0].first, 0);
  EXPECT_EQ(run.contacts[0].second, 1);
  EXPECT_NEAR(run.contacts[0].begin, 0.4, 0.02);
}

TEST_P(StepperContract, FallingOffTheWorldIsNoticedAndFrozen) {
  Scene scene;
  scene.name = "void";
  add_object(scene, primitive_model("ball", geometry::Sphere{0.05}), "ball");
  WorldState start = start_of(scene);
  simulation::RunRequest request;
  request.stop.duration = 10.0;
  request.stop.world_radius = 5.0;
  const belief::Trajectory run = run_one(*simulator_of(scene), start, request);
  EXPECT_EQ(run.end, TrajectoryEnd::kLeftTheWorld);
  EXPECT_NEAR(run.final().objects[0].X_WO.translation.z(), -5.0, 0.1);
  EXPECT_NEAR(run.simulated_seconds, std::sqrt(2.0 * 5.0 / kG), 0.01);
}

TEST_P(StepperContract, ThingsThatBeginInEachOtherAreTold) {
  Scene scene = floor_scene(primitive_model("box", BoxShape{{0.1, 0.1, 0.1}}));
  scene.objects[0].pose = belief::FixedPose{Pose::from_translation({0.0, 0.0, 0.02})};
  EXPECT_NEAR(run_actions(scene, {}, 1.0).deepest_overlap, 0.03, 1e-4);
  scene.objects[0].pose = belief::FixedPose{Pose::from_translation({0.0, 0.0, 0.2})};
  EXPECT_EQ(run_actions(scene, {}, 1.0).deepest_overlap, 0.0);  // what an impact does is no such overlap

  scene = held_scene();
  for (auto& [time, X_WG] : scene.robot[0].timeline) X_WG.translation.z() -= 0.46;
  scene.objects[0].pose = belief::FixedPose{Pose::from_translation({0.0, 0.0, 0.04})};
  EXPECT_EQ(run_actions(scene, {}, 1.0).deepest_overlap, 0.0);
  EXPECT_NEAR(run_actions(scene, {{0.5, release_of("object")}}, 1.0).deepest_overlap, 0.01, 1e-4);
}

TEST_P(StepperContract, AFastBallThatGripsKeepsFiveSeventhsOfItsSpeedWhereverInAStepItLands) {
  ObjectModel ball = primitive_model("ball", geometry::Sphere{0.03});
  ball.contact.friction = belief::FixedScalar{1.0};
  ball.contact.restitution = belief::FixedScalar{0.5};
  const Scene scene = floor_scene(ball);
  const auto simulator = simulator_of(scene);
  for (int i = 0; i < 20; ++i) {
    WorldState start = start_of(scene);
    start.objects[0].X_WO.translation = {0.0, 0.0, 0.06 + 0.0007 * i};
    start.objects[0].V_WO.linear = {1.0, 0.0, -4.0};
    simulation::RunRequest request;
    request.stop.duration = 0.03;
    const belief::Trajectory run = run_one(*simulator, start, request);
    ASSERT_GT(run.final().objects[0].V_WO.linear.z(), 1.0);
    EXPECT_NEAR(run.final().objects[0].V_WO.linear.x(), 5.0 / 7.0, 2e-3) << i;
  }
}

/// A free top turns about its angular momentum, and about its axis: R(t) = exp(L t / I) R exp(w_a (1 - I_a / I) t).
TEST_P(StepperContract, TopsSpinAsTheirClosedFormSays) {
  // Radius and length (m), spin about the axis and across it (rad/s): slender ones, where the axis' moment is small,
  // to a disc.
  const double tops[][4] = {{0.01, 0.25, 50.0, 20.0},  {0.01, 0.25, 30.0, 15.0},  {0.004, 0.18, 50.0, 20.0},
                            {0.02, 0.20, 40.0, 40.0},  {0.035, 0.24, 60.0, 60.0}, {0.004, 0.18, 200.0, 1.0},
                            {0.002, 0.40, 10.0, 60.0}, {0.1, 0.02, 60.0, 10.0}};
  // In single precision a fast spin's rounding is much of a slow one across it.
  const double close = std::max(1e-6, 5e3 * GetParam().precision);
  for (const auto& [radius, length, axial, across] : tops) {
    Scene scene = floor_scene(primitive_model("top", geometry::Cylinder{radius, length}));
    scene.gravity_W.setZero();
    auto instance = simulator_of(scene)->make_instance({}, core::RandomStream(1, core::Purpose::kTest));
    WorldState start = start_of(scene);
    start.objects[0].X_WO.translation = {0.0, 0.0, 3.0};
    start.objects[0].V_WO.angular = {across, 0.0, axial};
    instance->set_state(start);
    const geometry::Vector3d moments = scene.models[0].unit_inertia.diagonal();
    const geometry::Vector3d L = moments.cwiseProduct(start.objects[0].V_WO.angular);
    const double seconds = 1.0;
    step_for(*instance, seconds);
    const belief::ObjectState end = instance->state().objects[0];
    const geometry::Quaterniond expected =
        geometry::exp_rotation(seconds / moments.x() * L) * start.objects[0].X_WO.rotation *
        geometry::exp_rotation(seconds * axial * (1.0 - moments.z() / moments.x()) * geometry::Vector3d::UnitZ());
    const geometry::Matrix3d R = end.X_WO.rotation.toRotationMatrix();
    EXPECT_LT(geometry::log_rotation(expected.conjugate() * end.X_WO.rotation).norm(), close)
        << radius << " x " << length;
    const geometry::Vector3d L_end = R * moments.asDiagonal() * R.transpose() * end.V_WO.angular;
    EXPECT_LT((L_end - L).norm(), close * L.norm()) << radius << " x " << length;
    EXPECT_NEAR(L_end.dot(end.V_WO.angular) / L.dot(start.objects[0].V_WO.angular), 1.0, 1e-4)
        << radius << " x " << length;
  }
}

/// Bodies with three moments, slender ones too: the energy sways, and never by much.
TEST_P(StepperContract, TumblingKeepsAngularMomentumAndEnergy) {
  const double bricks[][6] = {{0.3, 0.02, 0.015, 5.0, 40.0, 3.0},
                              {0.2, 0.1, 0.05, 0.1, 12.0, 0.2},
                              {0.2, 0.1, 0.05, 20.0, 30.0, 10.0},
                              {0.25, 0.21, 0.01, 30.0, 5.0, 20.0},
                              {0.18, 0.008, 0.007, 150.0, 20.0, 5.0}};
  for (const auto& [x, y, z, wx, wy, wz] : bricks) {
    Scene scene = floor_scene(primitive_model("brick", BoxShape{{x, y, z}}));
    scene.gravity_W.setZero();
    auto instance = simulator_of(scene)->make_instance({}, core::RandomStream(1, core::Purpose::kTest));
    WorldState start = start_of(scene);
    start.objects[0].X_WO.translation = {0.0, 0.0, 3.0};
    start.objects[0].V_WO.angular = {wx, wy, wz};
    instance->set_state(start);
    const geometry::Matrix3d inertia = scene.models[0].unit_inertia;
    const geometry::Vector3d L = inertia * start.objects[0].V_WO.angular;
    const double energy = L.dot(start.objects[0].V_WO.angular);
    for (int n = 0; n < 200; ++n) {
      step_for(*instance, 0.05);
      const belief::ObjectState o = instance->state().objects[0];
      const geometry::Matrix3d R = o.X_WO.rotation.toRotationMatrix();
      const geometry::Vector3d L_now = R * inertia * R.transpose() * o.V_WO.angular;
      ASSERT_LT((L_now - L).norm(), 1e-3 * L.norm()) << x << " x " << y << " x " << z << ", " << n;
      ASSERT_NEAR(L_now.dot(o.V_WO.angular) / energy, 1.0, 0.01) << x << " x " << y << " x " << z << ", " << n;
    }
  }
}

TEST_P(StepperContract, WhatCreepsDownASlopeIsNotAtRest) {
  const double angle = 20.0 * kPi / 180.0;
  const ObjectModel block = primitive_model("block", BoxShape{{0.1, 0.1, 0.04}});
  simulation::RunRequest request;
  request.stop.duration = 2.0;
  for (const double more : {-5e-3, 5e-3}) {
    const Scene scene = incline_scene(block, 0.02, angle, std::tan(angle) + more);
    const belief::Trajectory run = run_one(*simulator_of(scene), start_of(scene), request);
    const double way = (run.final().objects[0].X_WO.translation - run.states[0].objects[0].X_WO.translation).norm();
    const double acceleration = kG * std::cos(angle) * 5e-3;
    if (more < 0.0) {
      EXPECT_EQ(run.end, TrajectoryEnd::kDuration);
      EXPECT_NEAR(way, 0.5 * acceleration * 4.0, 0.02 * way);
    } else {
      EXPECT_EQ(run.end, TrajectoryEnd::kAtRest);
      EXPECT_LT(way, 1e-4);
    }
  }
}

TEST_P(StepperContract, WhatIsWedgedGainsNoEnergy) {
  // A heavy box drops on one of ten grams between walls that lean to each other downwards.
  Scene scene;
  scene.name = "wedge";
  scene.supports.push_back(floor_support());
  for (const double side : {-1.0, 1.0})
    scene.supports.push_back(
        support_of(side < 0.0 ? "left" : "right", {belief::PrimitiveShape{BoxShape{{0.02, 0.3, 0.36}}, Pose{}}},
                   Pose{about(Vector3d::UnitY(), -side * 5.0 * kPi / 180.0), Vector3d(side * 0.085, 0.0, 0.25)}));
  add_object(scene, primitive_model("light", BoxShape{{0.09, 0.1, 0.1}}, 0.01), "light");
  add_object(scene, primitive_model("heavy", BoxShape{{0.05, 0.08, 0.08}}, 5.0), "heavy");
  scene.objects[0].pose = belief::FixedPose{Pose::from_translation({0.0, 0.0, 0.55})};
  scene.objects[1].pose = belief::FixedPose{Pose::from_translation({0.0, 0.0, 0.75})};
  const auto simulator = simulator_of(scene);
  simulation::RunRequest request;
  request.stop.duration = 1.0;
  request.sample_interval = simulator->step_size();
  core::RandomStream stream(5, core::Purpose::kTest);
  std::vector<WorldState> starts(24, start_of(scene));
  for (WorldState& start : starts)
    for (belief::ObjectState& object : start.objects) {
      object.X_WO.translation.x() += 0.01 * stream.normal();
      const double about_z = 0.6 * stream.normal(), about_y = 0.2 * stream.normal(), about_x = 0.2 * stream.normal();
      object.X_WO.rotation = geometry::exp_rotation(Vector3d(about_x, about_y, about_z));
    }
  std::vector<belief::Trajectory> runs(starts.size());
  core::ThreadPool pool(1);
  simulator->run(starts, request, stream, 0, pool, runs);
  const auto energy = [&](const WorldState& state) {
    double sum = 0.0;
    for (std::size_t i = 0; i < state.objects.size(); ++i) {
      const belief::ObjectState& object = state.objects[i];
      const Vector3d spin_O = object.X_WO.rotation.conjugate() * object.V_WO.angular;
      sum += object.physical.mass * (kG * object.X_WO.translation.z() + 0.5 * object.V_WO.linear.squaredNorm() +
                                     0.5 * spin_O.dot(scene.models[i].unit_inertia * spin_O));
    }
    return sum;
  };
  for (const belief::Trajectory& run : runs) {
    EXPECT_NE(run.end, TrajectoryEnd::kDiverged);
    const double begin = energy(run.start());
    for (const WorldState& state : run.states) ASSERT_LT(energy(state), 1.05 * begin) << "at " << state.time << " s";
  }
}

TEST_P(StepperContract, NotANumberIsDivergenceNotAnAnswer) {
  Scene scene = floor_scene(primitive_model("ball", geometry::Sphere{0.05}));
  WorldState start = start_of(scene);
  start.objects[0].X_WO.translation.z() = 1.0;
  start.objects[0].V_WO.linear.x() = std::nan("");
  simulation::RunRequest request;
  const belief::Trajectory run = run_one(*simulator_of(scene), start, request);
  EXPECT_EQ(run.end, TrajectoryEnd::kDiverged);
}

TEST_P(StepperContract, CancelledRunsSaySo) {
  const Scene scene = floor_scene(primitive_model("ball", geometry::Sphere{0.05}));
  const std::vector<WorldState> starts(3, start_of(scene));
  std::vector<belief::Trajectory> runs(3);
  core::ThreadPool pool(1);
  core::Cancellation cancellation;
  cancellation.request();
  simulator_of(scene)->run(starts, {}, core::RandomStream(3, core::Purpose::kAction), 0, pool, runs, &cancellation);
  for (const belief::Trajectory& run : runs) EXPECT_EQ(run.end, TrajectoryEnd::kCancelled);
}

TEST_P(StepperContract, StatesAreKeptAtTheSampleInterval) {
  Scene scene = floor_scene(primitive_model("ball", geometry::Sphere{0.05}));
  WorldState start = start_of(scene);
  start.time = 2.0;
  start.objects[0].X_WO.translation.z() = 3.0;
  simulation::RunRequest request;
  request.stop.duration = 0.55;
  request.sample_interval = 0.1;
  const belief::Trajectory run = run_one(*simulator_of(scene), start, request);
  ASSERT_EQ(run.states.size(), 7u);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(run.states[i].time, 2.0 + 0.1 * static_cast<double>(i), 0.5 / 240.0);
  EXPECT_NEAR(run.states[6].time, 2.55, 1e-9);
  EXPECT_EQ(run.end, TrajectoryEnd::kDuration);
}

TEST_P(StepperContract, IntervalsBeginAtTheImpactAndCarryItsImpulse) {
  ObjectModel box = primitive_model("box", BoxShape{{0.1, 0.1, 0.1}}, 2.0);
  Scene scene = floor_scene(box);
  WorldState start = start_of(scene);
  const double fall = 0.3;
  start.objects[0].X_WO.translation.z() = 0.05 + fall;
  simulation::RunRequest request;
  const belief::Trajectory run = run_one(*simulator_of(scene), start, request);
  ASSERT_EQ(run.contacts.size(), 1u);
  const belief::ContactInterval& c = run.contacts[0];
  EXPECT_EQ(c.first, 0);
  EXPECT_EQ(c.second, 1);
  EXPECT_NEAR(c.begin, std::sqrt(2.0 * fall / kG), 1.5 / 240.0);
  EXPECT_NEAR(c.end, run.final().time, 1e-9);
  EXPECT_NEAR(c.largest_impulse, 2.0 * std::sqrt(2.0 * kG * fall), 0.1);
  EXPECT_NEAR(c.normal_z, 1.0, fine(1e-9));
}

TEST_P(StepperContract, WhatLiesOnAWallThatIsBelowRestsOnIt) {
  ObjectModel box = primitive_model("box", BoxShape{{0.1, 0.1, 0.1}}, 2.0);
  for (const Vector3d& down : {Vector3d(1.0, 0.0, 0.0), Vector3d(0.0, -1.0, 0.0), Vector3d(0.0, 0.6, 0.8)}) {
    // A floor whose upper face holds the origin and looks against gravity.
    Scene scene = floor_scene(box);
    scene.gravity_W = kG * down;
    const Quaterniond R_WF = Quaterniond::FromTwoVectors(Vector3d::UnitZ(), -down);
    scene.supports[0].X_WS = geometry::Pose{R_WF, Vector3d::Zero()} * scene.supports[0].X_WS;
    WorldState start = start_of(scene);
    start.objects[0].X_WO = {R_WF, -0.0505 * down};
    simulation::RunRequest request;
    const belief::Trajectory run = run_one(*simulator_of(scene), start, request);
    ASSERT_EQ(run.contacts.size(), 1U) << down.transpose();
    EXPECT_NEAR(run.contacts[0].normal_z, 1.0, fine(1e-6)) << down.transpose();
    const std::string floor = scene.supports[0].name;
    EXPECT_TRUE(belief::holds(scene, run, {"lies", "object", {belief::Condition{belief::RestingOn{floor}}}}));
  }
}

TEST_P(StepperContract, SnapshotsAreForTheSameMechanicsAlone) {
  const Scene scene = held_scene();
  const std::vector<belief::Action> actions = {{0.1, belief::Release{"object", {0.0, 0.0, 0.1}}}};
  const core::RandomStream stream(5, core::Purpose::kTest);
  auto saved = simulator_of(scene)->make_instance(actions, stream);
  step_for(*saved, 0.2);
  const simulation::Snapshot snapshot = saved->save();
  const auto refused = [&](const Scene& other, const std::vector<belief::Action>& does,
                           const simulation::MechanicsOptions& options = {}) {
    auto instance = simulator_of(other, options)->make_instance(does, stream);
    const WorldState before = instance->state();
    const bool accepted = instance->restore(snapshot).ok();
    EXPECT_TRUE(accepted || instance->state() == before);
    return !accepted;
  };
  EXPECT_FALSE(refused(scene, actions));
  const auto changed = [&](const auto& change) {
    Scene of = scene;
    change(of);
    return of;
  };
  // What is seen and asked is no matter.
  const Scene alike = changed([](Scene& of) {
    of.name = "other";
    of.models[0].color = {0.1, 0.2, 0.3};
    of.duration = 1.0;
  });
  EXPECT_FALSE(refused(alike, actions));

  const Scene others[] = {
      changed([](Scene& of) { of.gravity_W.z() = -9.8; }),
      changed([](Scene& of) {
        of.models[0].collision = {belief::PrimitiveShape{BoxShape{{0.1, 0.1, 0.11}}, Pose{}}};
      }),
      changed([](Scene& of) { of.models[0].unit_inertia *= 1.1; }),
      changed([](Scene& of) { of.models[0].contact.edge_radius = 0.002; }),
      changed([](Scene& of) { of.supports[0].contact.friction = belief::FixedScalar{0.9}; }),
      changed([](Scene& of) { of.supports[0].X_WS.translation.z() -= 0.01; }),
      changed([](Scene& of) { of.robot[0].timeline[1].time = 2.5; }),
      changed([](Scene& of) { of.robot[0].contact.restitution = belief::FixedScalar{0.3}; }),
  };
  for (std::size_t i = 0; i < std::size(others); ++i) EXPECT_TRUE(refused(others[i], actions)) << "scene " << i;

  EXPECT_TRUE(refused(scene, {{0.1, belief::Release{"object", {0.0, 0.0, 0.2}}}}));
  EXPECT_TRUE(refused(scene, {{0.15, belief::Release{"object", {0.0, 0.0, 0.1}}}}));
  EXPECT_TRUE(refused(scene, {{0.1, belief::Grasp{"object", "hand"}}}));

  simulation::MechanicsOptions options;
  options.step = 1.0 / 1000.0;
  EXPECT_TRUE(refused(scene, actions, options));
  options = {};
  options.edge_rounding = 1e-3;
  EXPECT_TRUE(refused(scene, actions, options));
}

TEST_P(StepperContract, SnapshotsAreForTheSameDrawsOfActionsAlone) {
  const Scene scene = held_scene();
  belief::Release release{"object", {0.0, 0.0, 0.1}};
  release.disturbance.linear.x = belief::NormalScalar{0.0, 0.1};
  const auto instance = [&](std::uint64_t seed) {
    return simulator_of(scene)->make_instance({{0.1, release}}, core::RandomStream(seed, core::Purpose::kTest));
  };
  const simulation::Snapshot snapshot = instance(1)->save();
  EXPECT_TRUE(instance(1)->restore(snapshot).ok());
  EXPECT_FALSE(instance(2)->restore(snapshot).ok());
}

}  // namespace prescene::tests
