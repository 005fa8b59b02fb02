// SPDX-License-Identifier: Apache-2.0
// Hands of limited strength, which Bullet's stepper alone simulates: pulling, moving joints, inserting.
#include <gtest/gtest.h>

#include "bullet_scenes.h"
#include "prescene/simulation/similarity.h"

namespace prescene::tests::hands_laws_test {
namespace {

using belief::JointType;
using geometry::BoxShape;

belief::Trajectory run_actions(const Scene& scene, std::vector<belief::Action> actions, double duration) {
  simulation::RunRequest request;
  request.actions = std::move(actions);
  request.stop.duration = duration;
  request.stop.stop_at_rest = false;
  return run_one(*simulator_of(scene), start_of(scene), request);
}

Scene box_scene() {
  Scene scene = floor_scene(primitive_model("box", BoxShape{{0.1, 0.1, 0.1}}));
  scene.objects[0].pose = belief::FixedPose{Pose::from_translation({0.0, 0.0, 0.05})};
  return scene;
}

belief::Pull pull_of(double force) {
  belief::Pull pull;
  pull.object = "object";
  pull.by = {0.2, 0.0, 0.0};
  pull.force = belief::FixedScalar{force};
  return pull;
}

TEST(Hands, APullMovesWhatItsForceOvercomes) {
  const Scene scene = box_scene();  // friction 0.5, so 4.905 N
  const Vector3d weak = run_actions(scene, {{0.2, pull_of(4.7)}}, 2.0).final().objects[0].X_WO.translation;
  EXPECT_LT(std::abs(weak.x()), 1e-3);
  // It goes with the hand at 0.2 m/s, and slides on for v^2 / 2 mu g when the hand lets go.
  const Vector3d strong = run_actions(scene, {{0.2, pull_of(8.0)}}, 2.0).final().objects[0].X_WO.translation;
  EXPECT_NEAR(strong.x(), 0.2 + 0.04 / (2.0 * 0.5 * kG), 2e-3);
  EXPECT_LT(std::abs(strong.y()), 1e-6);
}

TEST(Hands, AWeakPullAcceleratesByItsForce) {
  Scene scene = box_scene();
  scene.gravity_W.setZero();
  scene.supports.clear();
  const belief::ObjectState end = run_actions(scene, {{0.0, pull_of(0.1)}}, 0.5).final().objects[0];
  EXPECT_NEAR(end.V_WO.linear.x(), 0.1 * 0.5, 1e-3);
  EXPECT_NEAR(end.X_WO.translation.x(), 0.5 * 0.1 * 0.25, 3e-4);
}

TEST(Hands, APullBesideTheCentreOfMassTurnsIt) {
  Scene scene = box_scene();
  scene.gravity_W.setZero();
  scene.supports.clear();
  belief::Pull pull = pull_of(0.01);
  pull.point_O = Vector3d(0.0, 0.05, 0.0);
  const belief::ObjectState end = run_actions(scene, {{0.0, pull}}, 0.1).final().objects[0];
  // Torque -F * arm about z over m a^2 / 6, for 0.1 s; it has hardly turned by then.
  EXPECT_NEAR(end.V_WO.angular.z(), -0.01 * 0.05 / (0.01 / 6.0) * 0.1, 2e-4);
}

/// A box that hangs on a slider along x, or on a hinge about z at its end, far from everything.
Scene jointed_scene(JointType type, double friction) {
  Scene scene;
  scene.name = "jointed";
  add_object(scene, primitive_model("box", BoxShape{{0.4, 0.1, 0.1}}), "box");
  scene.objects[0].pose = belief::FixedPose{Pose::from_translation({0.2, 0.0, 1.0})};
  belief::Joint joint;
  joint.name = "joint";
  joint.type = type;
  joint.child = "box";
  joint.axis_P = type == JointType::kSlider ? Vector3d::UnitX() : Vector3d::UnitZ();
  joint.anchor_P = {0.0, 0.0, 1.0};
  joint.X_PC0 = Pose::from_translation({0.2, 0.0, 1.0});
  joint.low = 0.0;
  joint.high = 1.5;
  joint.friction = belief::FixedScalar{friction};
  scene.joints.push_back(joint);
  return scene;
}

double position_after(const Scene& scene, const belief::MoveJoint& move, double duration) {
  return belief::joint_states(scene, run_actions(scene, {{0.1, move}}, duration).final())[0].position;
}

TEST(Hands, AJointIsMovedByMoreThanItsFrictionAndStaysThere) {
  belief::MoveJoint move;
  move.joint = "joint";
  move.to = 0.2;
  const Scene slider = jointed_scene(JointType::kSlider, 5.0);
  move.force = belief::FixedScalar{4.9};
  EXPECT_LT(position_after(slider, move, 2.0), 1e-3);
  move.force = belief::FixedScalar{7.0};
  EXPECT_NEAR(position_after(slider, move, 2.0), 0.2, 1e-3);
  move.force = belief::FixedScalar{20.0};
  EXPECT_NEAR(position_after(slider, move, 0.1 + 0.4), 0.1, 1e-3);  // half way of the first four fifths
  // Closed again.
  Scene open = slider;
  open.objects[0].pose = belief::FixedPose{Pose::from_translation({0.4, 0.0, 1.0})};
  move.to = 0.0;
  EXPECT_NEAR(position_after(open, move, 2.0), 0.0, 1e-3);
}

TEST(Hands, AHandleFartherFromTheHingeNeedsLessForce) {
  const Scene door = jointed_scene(JointType::kHinge, 1.0);  // N m
  belief::MoveJoint move;
  move.joint = "joint";
  move.type = JointType::kHinge;
  move.to = 1.0;
  move.force = belief::FixedScalar{4.0};
  EXPECT_LT(position_after(door, move, 2.0), 1e-2);  // at the centre of mass: 0.2 m * 4 N < 1 N m
  move.handle_C = Vector3d(0.2, 0.0, 0.0);           // 0.4 m * 4 N
  EXPECT_NEAR(position_after(door, move, 2.0), 1.0, 5e-3);
}

/// A hand holds a peg of 4 cm above a hole of 5 cm, `aside` of its middle.
Scene hole_scene(double aside) {
  Scene scene = floor_scene(primitive_model("peg", BoxShape{{0.04, 0.04, 0.1}}, 0.3));
  for (int side = 0; side < 4; ++side) {
    const double angle = 0.5 * kPi * side;
    const Quaterniond turn = about(Vector3d::UnitZ(), angle);
    scene.supports.push_back(support_of("wall" + std::to_string(side),
                                        {belief::PrimitiveShape{BoxShape{{0.1, 0.25, 0.08}}, Pose{}}},
                                        Pose{turn, turn * Vector3d(0.075, 0.0, 0.0) + Vector3d(0.0, 0.0, 0.04)}));
  }
  belief::KinematicBody hand;
  hand.name = "hand";
  hand.collision = {belief::PrimitiveShape{geometry::Sphere{0.01}, Pose{}}};
  hand.timeline = {{0.0, Pose::from_translation({0.0, 0.0, 0.25})}};
  scene.robot.push_back(hand);
  scene.objects[0].pose = belief::FixedPose{Pose::from_translation({aside, 0.0, 0.15})};
  scene.objects[0].held_by = "hand";
  return scene;
}

TEST(Hands, AnInsertedPegGoesInOrIsHeldUpByTheRim) {
  belief::Insert insert;
  insert.object = "object";
  insert.distance = 0.1;
  const auto height_after = [&](double aside, double duration) {
    return run_actions(hole_scene(aside), {{0.1, insert}}, duration).final().objects[0].X_WO.translation.z();
  };
  EXPECT_NEAR(height_after(0.0, 1.0), 0.05, 2e-3);    // it is at the bottom, and was on its line all the way
  EXPECT_NEAR(height_after(0.003, 2.0), 0.05, 2e-3);  // within the play
  EXPECT_NEAR(height_after(0.02, 1.0), 0.13, 3e-3);   // on the rim, while the hand presses
  EXPECT_GT(height_after(0.02, 2.0), 0.06);
}

TEST(Hands, AHandThatIsTooWeakForTheWeightLosesHeight) {
  belief::Insert insert;
  insert.object = "object";
  insert.axis_W = Vector3d::UnitX();
  insert.distance = 0.1;
  Scene scene = hole_scene(0.0);
  scene.supports.resize(1);
  scene.objects[0].pose = belief::FixedPose{Pose::from_translation({0.0, 0.0, 1.0})};
  const Vector3d strong = run_actions(scene, {{0.0, insert}}, 0.9).final().objects[0].X_WO.translation;
  EXPECT_LT((strong - Vector3d(0.1, 0.0, 1.0)).norm(), 2e-3);
  insert.force = belief::FixedScalar{0.5 * 0.3 * kG};
  const Vector3d weak = run_actions(scene, {{0.0, insert}}, 0.2).final().objects[0].X_WO.translation;
  EXPECT_LT(weak.z(), 1.0 - 0.2 * 0.5 * 0.04 * kG);
}

TEST(Hands, ForcesAndBlowsAreSimilarInASimilarScene) {
  // A grip that slips, and beside it a bump and a pull off the centre; a quarter of the size, so exact powers of two.
  Scene scene = hole_scene(0.0);
  scene.supports.clear();
  add_object(scene, primitive_model("free", BoxShape{{0.1, 0.1, 0.1}}), "free");
  scene.objects[1].pose = belief::FixedPose{Pose::from_translation({1.0, 0.0, 1.0})};
  belief::Grasp grasp{"object", "hand", belief::Grip{}};
  grasp.grip->force = belief::FixedScalar{2.0};
  grasp.grip->friction = belief::FixedScalar{0.5};
  belief::Bump bump;
  bump.object = "free";
  bump.impulse = belief::Vector3Distribution::fixed({0.1, 0.0, 0.2});
  bump.point_O = Vector3d(0.0, 0.03, 0.0);
  belief::Pull pull = pull_of(1.5);
  pull.object = "free";
  pull.point_O = Vector3d(0.0, 0.0, 0.04);
  simulation::RunRequest request;
  request.actions = {{0.0, grasp}, {0.1, bump}, {0.2, pull}};
  request.stop.duration = 0.5;
  const simulation::Similarity quarter{0.25};
  BulletOptions finer;
  finer.step *= quarter.time();
  const auto similar =
      simulation::make_scaled_simulator(simulator_of(simulation::scaled(scene, quarter), finer), quarter.inverse());
  const WorldState expected = run_one(*simulator_of(scene), start_of(scene), request).final();
  const WorldState found = run_one(*similar, start_of(scene), request).final();
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_LT((found.objects[i].X_WO.translation - expected.objects[i].X_WO.translation).norm(), 1e-9);
    EXPECT_LT(geometry::angle_between(found.objects[i].X_WO.rotation, expected.objects[i].X_WO.rotation), 1e-7);
    EXPECT_LT((found.objects[i].V_WO.linear - expected.objects[i].V_WO.linear).norm(), 1e-9);
  }
  EXPECT_LT(expected.objects[0].X_WO.translation.z(), 0.1);  // it slipped
}

TEST(Hands, ASnapshotGoesOnWithTheSameBitsWhileHandsDrive) {
  belief::MoveJoint move;
  move.joint = "joint";
  move.to = 0.2;
  const Scene scene = jointed_scene(JointType::kSlider, 5.0);
  const auto simulator = simulator_of(scene);
  const core::RandomStream stream(1, core::Purpose::kTest);
  const auto one = simulator->make_instance({{0.1, move}}, stream),
             other = simulator->make_instance({{0.1, move}}, stream);
  step_for(*one, 0.5);
  ASSERT_TRUE(other->restore(one->save()).ok());
  step_for(*one, 0.8);
  step_for(*other, 0.8);
  EXPECT_EQ(one->state(), other->state());
}

}  // namespace
}  // namespace prescene::tests::hands_laws_test
