// SPDX-License-Identifier: Apache-2.0
// Joints against closed-form mechanics, and what has to hold of any of them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "bullet_scenes.h"

namespace prescene::tests::joints_test {
namespace {

using belief::Joint;
using belief::JointType;
using geometry::BoxShape;

constexpr double kLength = 0.4;  // of rods, along x

constexpr double kWidth = 0.02;

/// Of a rod of 1 kg about its end, kg m^2.
constexpr double kRodInertia = kLength * kLength / 3.0 + kWidth * kWidth / 12.0;

ObjectModel rod(double mass = 1.0, const std::string& name = "rod") {
  return primitive_model(name, BoxShape{{kLength, kWidth, kWidth}}, mass);
}

/// Of the world and a rod that hangs down at 0, on an axis along y through one of its ends; positive angles lift it
/// towards -x.
Joint pivot(const std::string& child, const std::string& parent = "") {
  Joint joint;
  joint.name = child + "_pivot";
  joint.type = JointType::kHinge;
  joint.parent = parent;
  joint.child = child;
  joint.axis_P = Vector3d::UnitY();
  joint.anchor_P = parent.empty() ? Vector3d(0.0, 0.0, 2.0) : Vector3d(0.5 * kLength, 0.0, 0.0);
  const Vector3d arm(0.5 * kLength, 0.0, 0.0);
  const Quaterniond down = parent.empty() ? about(Vector3d::UnitY(), 0.5 * kPi) : Quaterniond::Identity();
  joint.X_PC0 = {down, joint.anchor_P + down * arm};
  return joint;
}

Scene pendulum() {
  Scene scene;
  scene.name = "pendulum";
  add_object(scene, rod(), "rod");
  scene.joints.push_back(pivot("rod"));
  return scene;
}

WorldState at(const Scene& scene, const std::vector<belief::JointState>& states) {
  WorldState start = start_of(scene);
  for (std::size_t j = 0; j < states.size(); ++j) {
    const Joint& joint = scene.joints[j];
    Pose X_WP;
    geometry::Twist V_WP;
    if (const auto parent = belief::find_object(scene, joint.parent)) {
      X_WP = start.objects[static_cast<std::size_t>(*parent)].X_WO;
      V_WP = start.objects[static_cast<std::size_t>(*parent)].V_WO;
    }
    belief::ObjectState& child = start.objects[static_cast<std::size_t>(*belief::find_object(scene, joint.child))];
    child.X_WO = belief::child_pose(joint, X_WP, states[j].position);
    child.V_WO = belief::child_twist(joint, X_WP, V_WP, states[j]);
  }
  return start;
}

belief::JointState joint_now(const Scene& scene, const simulation::Instance& instance, std::size_t j = 0) {
  return belief::joint_states(scene, instance.state())[j];
}

/// Kinetic and potential, J.
double energy(const Scene& scene, const WorldState& state) {
  double sum = 0.0;
  for (std::size_t i = 0; i < state.objects.size(); ++i) {
    const belief::ObjectState& o = state.objects[i];
    const geometry::Matrix3d R = o.X_WO.rotation.toRotationMatrix();
    const geometry::Matrix3d I = o.physical.mass * R * scene.model_of(scene.objects[i]).unit_inertia * R.transpose();
    sum += 0.5 * o.physical.mass * o.V_WO.linear.squaredNorm() + 0.5 * o.V_WO.angular.dot(I * o.V_WO.angular) -
           o.physical.mass * scene.gravity_W.dot(o.X_WO.translation);
  }
  return sum;
}

double worst_error(const Scene& scene, const WorldState& state) {
  double worst = 0.0;
  for (const Joint& joint : scene.joints) {
    Pose X_WP;
    if (const auto parent = belief::find_object(scene, joint.parent))
      X_WP = state.objects[static_cast<std::size_t>(*parent)].X_WO;
    const Pose& X_WC = state.objects[static_cast<std::size_t>(*belief::find_object(scene, joint.child))].X_WO;
    const belief::JointError error = belief::joint_error(joint, X_WP, X_WC);
    worst = std::max({worst, error.distance, error.angle});
  }
  return worst;
}

TEST(Joints, APendulumSwingsInItsPeriod) {
  const Scene scene = pendulum();
  const double period = 2.0 * kPi * std::sqrt(2.0 * kRodInertia / (kG * kLength));
  const double amplitude = 0.05;
  for (const double step : {1.0 / 240.0, 1.0 / 1000.0}) {
    BulletOptions options;
    options.step = step;
    auto instance = instance_of(scene, options);
    instance->set_state(at(scene, {{amplitude, 0.0}}));
    std::vector<double> crossings;
    double before = amplitude, largest = 0.0;
    for (int n = 1; crossings.size() < 21; ++n) {
      ASSERT_LT(n * step, 12.0 * period);
      instance->step();
      const double now = joint_now(scene, *instance).position;
      if (before * now <= 0.0) crossings.push_back(step * (n - now / (now - before)));
      if (crossings.size() == 20) largest = std::max(largest, std::abs(now));
      before = now;
    }
    const double measured = (crossings.back() - crossings.front()) / 10.0;
    // Of symplectic Euler: (angle of a step)^2 / 24 less.
    const double turn = 2.0 * kPi * step / period;
    EXPECT_NEAR(measured / period, 1.0 + amplitude * amplitude / 16.0 - turn * turn / 24.0, 1e-5) << step;
    EXPECT_NEAR(largest, amplitude, 1e-3 * amplitude) << step;  // and swings as far after ten of them
  }
}

TEST(Joints, ADoublePendulumKeepsItsEnergyAndStaysTogether) {
  Scene scene = pendulum();
  add_object(scene, rod(0.5, "light_rod"), "second");
  scene.joints.push_back(pivot("second", "rod"));
  BulletOptions options;
  options.step = 1e-3;
  auto instance = instance_of(scene, options);
  const WorldState start = at(scene, {{2.0, 0.0}, {0.5, 0.0}});
  instance->set_state(start);
  const double least = energy(scene, at(scene, {{0.0, 0.0}, {0.0, 0.0}}));
  const double begun = energy(scene, start) - least;
  for (int n = 0; n < 5000; ++n) {
    instance->step();
    const WorldState state = instance->state();
    ASSERT_NEAR(energy(scene, state) - least, begun, 0.02 * begun) << n;
    ASSERT_LT(worst_error(scene, state), 1e-5) << n;
  }
}

TEST(Joints, WithoutGravityFreePartsKeepTheirMomenta) {
  Scene scene;
  scene.gravity_W.setZero();
  add_object(scene, rod(1.0), "rod");
  add_object(scene, rod(0.3, "light_rod"), "second");
  scene.joints.push_back(pivot("second", "rod"));
  auto instance = instance_of(scene);
  WorldState start = start_of(scene);
  start.objects[0].V_WO = {{0.3, 2.0, 1.0}, {0.2, 0.1, -0.3}};
  const Joint& joint = scene.joints[0];
  start.objects[1].X_WO = belief::child_pose(joint, start.objects[0].X_WO, 0.7);
  start.objects[1].V_WO = belief::child_twist(joint, start.objects[0].X_WO, start.objects[0].V_WO, {0.7, -6.0});
  instance->set_state(start);
  const auto momenta = [&](const WorldState& state) {
    std::pair<Vector3d, Vector3d> sums{Vector3d::Zero(), Vector3d::Zero()};
    for (std::size_t i = 0; i < 2; ++i) {
      const belief::ObjectState& o = state.objects[i];
      const geometry::Matrix3d R = o.X_WO.rotation.toRotationMatrix();
      const Vector3d p = o.physical.mass * o.V_WO.linear;
      sums.first += p;
      sums.second += o.X_WO.translation.cross(p) +
                     o.physical.mass * R * scene.models[i].unit_inertia * R.transpose() * o.V_WO.angular;
    }
    return sums;
  };
  const auto [p, L] = momenta(start);
  const double begun = energy(scene, start);
  for (int n = 0; n < 720; ++n) {
    instance->step();
    const auto [p_now, L_now] = momenta(instance->state());
    ASSERT_LT((p_now - p).norm(), 1e-9 * p.norm()) << n;
    ASSERT_LT((L_now - L).norm(), 1e-3 * L.norm()) << n;
    ASSERT_NEAR(energy(scene, instance->state()), begun, 0.02 * begun) << n;
    ASSERT_LT(worst_error(scene, instance->state()), 5e-5) << n;
  }
}

constexpr double kSlope = 20.0 * kPi / 180.0;

/// A block of 2 kg on rails that fall towards +x by kSlope.
Scene rails(double friction, double damping = 0.0) {
  Scene scene;
  scene.name = "rails";
  add_object(scene, primitive_model("block", BoxShape{{0.1, 0.1, 0.1}}, 2.0), "block");
  Joint joint;
  joint.name = "rails";
  joint.type = JointType::kSlider;
  joint.child = "block";
  joint.axis_P = {std::cos(kSlope), 0.0, -std::sin(kSlope)};
  joint.anchor_P = {0.0, 0.0, 0.05};  // off the centre of mass: the rails hold its tilt as well
  joint.friction = belief::FixedScalar{friction};
  joint.damping = belief::FixedScalar{damping};
  scene.joints.push_back(joint);
  return scene;
}

TEST(Joints, ASliderHoldsUpToItsFrictionAndSlidesBeyond) {
  const double pull = 2.0 * kG * std::sin(kSlope);
  for (const double share : {1.001, 0.999, 0.5, 0.0}) {
    const Scene scene = rails(share * pull);
    auto instance = instance_of(scene);
    step_for(*instance, 1.0);
    const belief::JointState state = joint_now(scene, *instance);
    const double acceleration = std::max(0.0, 1.0 - share) * pull / 2.0;
    EXPECT_NEAR(state.velocity, acceleration, 1e-9) << share;
    // Velocities are those of the ends of steps.
    EXPECT_NEAR(state.position, 0.5 * acceleration * (1.0 + instance->step_size()), 1e-8) << share;
    EXPECT_LT(worst_error(scene, instance->state()), 1e-9);
  }
}

TEST(Joints, DampingDecaysAtItsRateAndEndsAtItsSpeed) {
  Scene scene = rails(0.0, 3.0);
  auto instance = instance_of(scene);
  const double pull = 2.0 * kG * std::sin(kSlope);
  step_for(*instance, 12.0);
  EXPECT_NEAR(joint_now(scene, *instance).velocity, pull / 3.0, 1e-6 * pull);

  scene.gravity_W.setZero();
  instance = instance_of(scene);
  instance->set_state(at(scene, {{0.0, 1.5}}));
  step_for(*instance, 1.0);
  EXPECT_NEAR(joint_now(scene, *instance).velocity, 1.5 * std::exp(-3.0 / 2.0), 0.005);

  Scene swing = pendulum();
  swing.gravity_W.setZero();
  swing.joints[0].damping = belief::FixedScalar{0.1};
  instance = instance_of(swing);
  instance->set_state(at(swing, {{0.0, 1.5}}));
  step_for(*instance, 1.0);
  EXPECT_NEAR(joint_now(swing, *instance).velocity / (1.5 * std::exp(-0.1 / kRodInertia)), 1.0, 0.01);
}

TEST(Joints, LimitsHold) {
  Scene scene = pendulum();
  scene.joints[0].low = -0.3;
  scene.joints[0].high = 1.6;
  auto instance = instance_of(scene);
  instance->set_state(at(scene, {{1.5, 0.0}}));
  double least = 1.5;
  for (int n = 0; n < 960; ++n) {
    instance->step();
    least = std::min(least, joint_now(scene, *instance).position);
  }
  EXPECT_NEAR(least, -0.3, 1e-4);

  Scene falling = rails(0.0);
  falling.joints[0].high = 0.2;
  instance = instance_of(falling);
  step_for(*instance, 2.0);
  EXPECT_NEAR(joint_now(falling, *instance).position, 0.2, 1e-6);
  EXPECT_NEAR(joint_now(falling, *instance).velocity, 0.0, 1e-9);
}

TEST(Joints, StartsAreMovedOntoTheirJoints) {
  const Scene scene = pendulum();
  auto instance = instance_of(scene);
  WorldState start = at(scene, {{0.4, 0.0}});
  start.objects[0].X_WO.translation += Vector3d(0.003, -0.002, 0.004);
  instance->set_state(start);
  EXPECT_LT(worst_error(scene, instance->state()), 1e-12);
  EXPECT_NEAR(joint_now(scene, *instance).position, 0.4, 1e-9);
}

TEST(Joints, DirectlyJointedPartsDoNotTouchAndOthersDo) {
  Scene scene = rails(0.0);
  scene.joints[0].axis_P = -Vector3d::UnitX();
  scene.joints[0].parent = "cabinet";
  const auto block_of = [](const Vector3d& size) {
    return std::vector<belief::CollisionShape>{belief::PrimitiveShape{BoxShape{size}, Pose{}}};
  };
  scene.supports.push_back(support_of("cabinet", block_of({0.5, 0.5, 0.5}), Pose{}));
  // From where the block starts, its front has 0.4 m to go.
  scene.supports.push_back(support_of("wall", block_of({0.6, 0.6, 0.6}), Pose::from_translation({-0.75, 0.0, 0.0})));
  WorldState start = start_of(scene);
  start.objects[0].V_WO.linear = {-0.41, 0.0, 0.0};
  auto instance = instance_of(scene);
  instance->set_state(start);
  step_for(*instance, 0.5);
  EXPECT_NEAR(joint_now(scene, *instance).position, 0.205, 1e-6);  // out of the cabinet, which does not stop it
  const auto run =
      run_one(*simulator_of(scene), start, {.actions = {}, .stop = {.duration = 1.5, .stop_at_rest = false}});
  // It may stop short by what it goes in a step.
  EXPECT_NEAR(belief::joint_states(scene, run.final())[0].position, 0.4, 2e-3);
  ASSERT_FALSE(run.contacts.empty());
  for (const belief::ContactInterval& contact : run.contacts) EXPECT_EQ(contact.second, 2);  // the wall
}

TEST(Joints, WhatBalancesOnItsHingeIsNotAtRest) {
  const Scene scene = pendulum();
  const auto rests = [&](double position) {
    const auto run =
        run_one(*simulator_of(scene), at(scene, {{position, 0.0}}), {.actions = {}, .stop = {.duration = 0.6}});
    return run.end == belief::TrajectoryEnd::kAtRest;
  };
  EXPECT_TRUE(rests(0.0));
  EXPECT_FALSE(rests(kPi));
  Scene stiff = scene;
  stiff.joints[0].friction = belief::FixedScalar{0.5};
  const auto run = run_one(*simulator_of(stiff), at(stiff, {{kPi, 0.0}}), {.actions = {}, .stop = {.duration = 0.6}});
  EXPECT_EQ(run.end, belief::TrajectoryEnd::kAtRest);
}

TEST(Joints, ABoxKeepsItsLidWhereItIsPushed) {
  Scene scene = floor_scene(primitive_model("box", BoxShape{{0.2, 0.2, 0.1}}, 2.0));
  scene.objects[0].pose = belief::FixedPose{Pose::from_translation({0.0, 0.0, 0.05})};
  add_object(scene, primitive_model("lid", BoxShape{{0.2, 0.2, 0.01}}, 0.3), "lid");
  Joint joint;
  joint.name = "lid_hinge";
  joint.parent = "object";
  joint.child = "lid";
  joint.axis_P = Vector3d::UnitY();
  joint.anchor_P = {-0.1, 0.0, 0.055};
  joint.X_PC0 = Pose::from_translation({0.0, 0.0, 0.055});
  joint.low = -2.0;
  joint.high = 0.0;
  scene.joints.push_back(joint);
  WorldState start = start_of(scene);
  start.objects[1].X_WO = belief::child_pose(joint, start.objects[0].X_WO, -1.2);
  start.objects[0].V_WO.linear = start.objects[1].V_WO.linear = {0.8, 0.0, 0.0};
  const auto run = run_one(*simulator_of(scene), start, {.actions = {}, .stop = {.duration = 4.0}});
  EXPECT_EQ(run.end, belief::TrajectoryEnd::kAtRest);
  const auto states = belief::joint_states(scene, run.final());
  EXPECT_NEAR(states[0].position, 0.0, 1e-3);  // it fell shut
  EXPECT_LT(worst_error(scene, run.final()), 1e-5);
  EXPECT_GT(run.final().objects[0].X_WO.translation.x(), 0.01);
}

TEST(Joints, SnapshotsGoOnWithTheSameBits) {
  Scene scene = pendulum();
  scene.joints[0].friction = belief::FixedScalar{0.02};
  auto instance = instance_of(scene);
  instance->set_state(at(scene, {{1.0, 0.0}}));
  step_for(*instance, 0.3);
  const simulation::Snapshot snapshot = instance->save();
  step_for(*instance, 0.3);
  const WorldState once = instance->state();
  ASSERT_TRUE(instance->restore(snapshot).ok());
  step_for(*instance, 0.3);
  EXPECT_EQ(instance->state(), once);
}

}  // namespace
}  // namespace prescene::tests::joints_test
