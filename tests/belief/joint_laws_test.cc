// SPDX-License-Identifier: Apache-2.0
#include "prescene/belief/joint.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "prescene/belief/belief.h"
#include "prescene/belief/json.h"
#include "prescene/geometry/angles.h"
#include "prescene/geometry/sampling.h"
#include "tests/belief/random_values.h"
#include "tests/support/laws.h"

namespace prescene::belief::joint_laws_test {
namespace {

using core::RandomStream;
using testing::HasSubstr;
using tests::random_pose;
using tests::random_vector;

constexpr double kPi = std::numbers::pi;

Joint random_joint(RandomStream& stream, JointType type) {
  Joint joint;
  joint.name = "joint";
  joint.type = type;
  joint.parent = "block";
  joint.child = "ball";
  joint.axis_P = geometry::uniform_direction(stream);
  joint.anchor_P = random_vector(stream);
  joint.X_PC0 = random_pose(stream);
  return joint;
}

Twist random_twist(RandomStream& stream) { return {random_vector(stream), random_vector(stream)}; }

Pose moved_by(const Pose& X, const Twist& V, double dt) {
  return {geometry::exp_rotation(dt * V.angular) * X.rotation, X.translation + dt * V.linear};
}

TEST(JointLaws, APositionAndARateComeBack) {
  EXPECT_TRUE(rc::check([](std::uint64_t seed, bool hinge) {
    RandomStream stream(seed, core::Purpose::kTest);
    const Joint joint = random_joint(stream, hinge ? JointType::kHinge : JointType::kSlider);
    const Pose X_WP = random_pose(stream);
    const Twist V_WP = random_twist(stream);
    const JointState given{stream.uniform(-3.0, 3.0), stream.uniform(-2.0, 2.0)};
    const Pose X_WC = child_pose(joint, X_WP, given.position);
    const Twist V_WC = child_twist(joint, X_WP, V_WP, given);
    const JointState read = joint_state(joint, X_WP, V_WP, X_WC, V_WC);
    RC_ASSERT(std::abs(read.position - given.position) < 1e-9);
    RC_ASSERT(std::abs(read.velocity - given.velocity) < 1e-9);
    const JointError error = joint_error(joint, X_WP, X_WC);
    RC_ASSERT(error.distance < 1e-9 && error.angle < 1e-7);
    // The twist is the derivative of the pose.
    const double dt = 1e-6;
    const Pose later = child_pose(joint, moved_by(X_WP, V_WP, dt), given.position + dt * given.velocity);
    const Pose extrapolated = moved_by(X_WC, V_WC, dt);
    RC_ASSERT((later.translation - extrapolated.translation).norm() < 1e-10);
    RC_ASSERT(geometry::angle_between(later.rotation, extrapolated.rotation) < 1e-7);
  }));
}

TEST(JointLaws, WhatIsOffIsToldAsSuch) {
  EXPECT_TRUE(rc::check([](std::uint64_t seed, bool hinge) {
    RandomStream stream(seed, core::Purpose::kTest);
    const Joint joint = random_joint(stream, hinge ? JointType::kHinge : JointType::kSlider);
    const Pose X_WP = random_pose(stream);
    const Vector3d axis_W = X_WP.rotation * joint.axis_P;
    Pose X_WC = child_pose(joint, X_WP, 0.3);
    const Vector3d across = axis_W.unitOrthogonal();
    X_WC.translation += 0.01 * across;
    RC_ASSERT(std::abs(joint_error(joint, X_WP, X_WC).distance - 0.01) < 1e-9);
    X_WC = child_pose(joint, X_WP, 0.3);
    const Vector3d anchor_W = X_WC * (joint.X_PC0.inverse() * joint.anchor_P);
    const geometry::Quaterniond tilt = geometry::exp_rotation(0.02 * across);
    X_WC = Pose{tilt, anchor_W - tilt * anchor_W} * X_WC;
    const JointError error = joint_error(joint, X_WP, X_WC);
    RC_ASSERT(std::abs(error.angle - 0.02) < 1e-6 && error.distance < 1e-9);
  }));
}

TEST(Joints, AHingeIsToldAboutTheMiddleOfItsLimits) {
  Joint joint;
  joint.type = JointType::kHinge;
  joint.low = -0.1;
  joint.high = 1.9 * kPi - 0.1;
  const JointState state = joint_state(joint, {}, {}, child_pose(joint, {}, 1.5 * kPi), {});
  EXPECT_NEAR(state.position, 1.5 * kPi, 1e-9);
}

/// Two positions of equal weight on both sides of half a turn: their mean is half a turn, and not 0.
TEST(Joints, AFreeHingeIsEstimatedAcrossHalfATurn) {
  Scene scene = tests::small_scene();
  Joint joint;
  joint.name = "spin";
  joint.child = "ball";
  joint.axis_P = Vector3d::UnitZ();
  scene.joints = {joint};
  Belief belief;
  ObjectBelief& ball = belief.objects.emplace_back();
  ball.name = "ball";
  for (const double degrees : {170.0, -178.0}) {
    Particle particle;
    particle.X_WO = child_pose(joint, {}, degrees * kPi / 180.0);
    particle.log_weight = std::log(0.5);
    ball.particles.push_back(particle);
  }
  belief.scene = std::make_shared<const Scene>(scene);
  const std::vector<JointEstimate> estimates = joint_estimates(belief);
  ASSERT_EQ(estimates.size(), 1u);
  EXPECT_NEAR(estimates[0].position, 176.0 * kPi / 180.0, 1e-9);
  EXPECT_NEAR(estimates[0].standard_deviation, 6.0 * kPi / 180.0, 1e-6);
}

TEST(Joints, AFreeHingeHasPositionsWithinHalfATurn) {
  Scene scene = tests::small_scene();
  Joint joint;
  joint.name = "spin";
  joint.child = "ball";
  scene.joints = {joint};
  const auto checked = [&](double low_deg, double high_deg) {
    const JointWithin within{"spin", JointType::kHinge, low_deg * kPi / 180.0, high_deg * kPi / 180.0};
    return validate(scene, Outcome{"o", "ball", {Condition{within}}});
  };
  EXPECT_TRUE(checked(-180.0, 180.0).ok());
  EXPECT_THAT(checked(200.0, 300.0).message(), testing::HasSubstr("between -180 and 180 degrees"));
  EXPECT_FALSE(checked(170.0, 190.0).ok());
  scene.joints[0].low = 0.0;
  scene.joints[0].high = 300.0 * kPi / 180.0;
  EXPECT_TRUE(checked(200.0, 300.0).ok());
}

Scene jointed_scene() {
  Scene scene = tests::small_scene();
  Joint joint;
  joint.name = "slide";
  joint.type = JointType::kSlider;
  joint.parent = "table";
  joint.child = "ball";
  joint.axis_P = Vector3d::UnitX();
  joint.low = -0.5;
  joint.high = 0.5;
  joint.friction = NormalScalar{1.0, 0.2, 0.0};
  scene.joints.push_back(joint);
  return scene;
}

/// As passes through the joints find it that take each joint whose parent is placed; loops are left out.
std::vector<int> order_by_passes(const Scene& scene) {
  std::vector<int> order;
  std::vector<bool> done(scene.joints.size(), false);
  for (bool more = true; more;) {
    more = false;
    for (std::size_t j = 0; j < scene.joints.size(); ++j) {
      const std::optional<int> before = joint_of(scene, scene.joints[j].parent);
      if (done[j] || (before && !done[static_cast<std::size_t>(*before)])) continue;
      order.push_back(static_cast<int>(j));
      done[j] = more = true;
    }
  }
  return order;
}

TEST(JointLaws, TheOrderIsThatOfPassesThroughTheJoints) {
  EXPECT_TRUE(tests::check_law([](std::uint64_t seed) {
    RandomStream stream(seed, core::Purpose::kTest);
    const auto below = [&](std::size_t n) {
      return static_cast<std::size_t>(stream.uniform() * static_cast<double>(n));
    };
    Scene scene;
    const std::size_t count = 1 + below(12);
    for (std::size_t j = 0; j < count; ++j) {
      Joint joint;
      joint.child = "o" + std::to_string(below(14));
      joint.parent = "o" + std::to_string(below(14));
      scene.joints.push_back(joint);
    }
    RC_ASSERT(joint_order(scene) == order_by_passes(scene));
  }));
}

/// With the children listed first, passes would take the square of the number, and each look-up the number.
TEST(Joints, ALongChainIsOrdered) {
  constexpr int kCount = 20'000;
  Scene scene;
  for (int j = 0; j < kCount; ++j) {
    Joint joint;
    joint.child = std::to_string(j);
    joint.parent = std::to_string(j + 1);
    scene.joints.push_back(joint);
  }
  const std::vector<int> order = joint_order(scene);
  ASSERT_EQ(order.size(), scene.joints.size());
  for (int j = 0; j < kCount; ++j) ASSERT_EQ(order[static_cast<std::size_t>(j)], kCount - 1 - j);
}

TEST(Joints, AreObeyedParentsFirst) {
  Scene scene = jointed_scene();
  Joint lid;
  lid.name = "lid";
  lid.parent = "ball";
  lid.child = "block";
  lid.axis_P = Vector3d::UnitY();
  scene.joints.insert(scene.joints.begin(), lid);
  EXPECT_THAT(joint_order(scene), testing::ElementsAre(1, 0));
  RandomStream stream(3, core::Purpose::kTest);
  WorldState state = mean_start(scene);
  for (ObjectState& object : state.objects) {
    object.X_WO = random_pose(stream);
    object.V_WO = random_twist(stream);
    object.mode = MotionMode::kMoving;
  }
  obey_joints(scene, state);
  const Pose X_WT = scene.supports[static_cast<std::size_t>(*find_support(scene, "table"))].X_WS;
  const ObjectState& ball = state.objects[static_cast<std::size_t>(*find_object(scene, "ball"))];
  const ObjectState& block = state.objects[static_cast<std::size_t>(*find_object(scene, "block"))];
  EXPECT_LT(joint_error(scene.joints[1], X_WT, ball.X_WO).distance, 1e-9);
  EXPECT_LT(joint_error(lid, ball.X_WO, block.X_WO).distance, 1e-9);
  EXPECT_LE(std::abs(joint_states(scene, state)[1].position), 0.5 + 1e-9);
  WorldState again = state;
  obey_joints(scene, again);
  EXPECT_EQ(again, state);  // what obeys already keeps its bits
}

TEST(Joints, StartsDrawTheirFrictionAndDamping) {
  const Scene scene = jointed_scene();
  const Scene without = tests::small_scene();
  EXPECT_EQ(start_dimensions(scene), start_dimensions(without) + 1);
  std::vector<double> uniforms(static_cast<std::size_t>(start_dimensions(scene)), 0.5);
  const WorldState low = draw_start(scene, uniforms);
  ASSERT_EQ(low.joints.size(), 1u);
  EXPECT_NEAR(low.joints[0].friction, 1.0, 1e-6);
  uniforms.back() = 0.9;
  EXPECT_NEAR(draw_start(scene, uniforms).joints[0].friction, 1.0 + 0.2 * 1.2816, 1e-3);
}

TEST(Joints, WhatCanNotBeIsRefused) {
  const auto message = [](const auto& change) {
    Scene scene = jointed_scene();
    change(scene.joints[0], scene);
    return validate(scene).message();
  };
  EXPECT_EQ(message([](Joint&, Scene&) {}), "");
  EXPECT_THAT(message([](Joint& j, Scene&) { j.child = "table"; }), HasSubstr("only objects move"));
  EXPECT_THAT(message([](Joint& j, Scene&) { j.parent = "moon"; }), HasSubstr("neither an object nor a support"));
  EXPECT_THAT(message([](Joint& j, Scene&) { j.parent = "ball"; }), HasSubstr("the same"));
  EXPECT_THAT(message([](Joint& j, Scene&) { j.axis_P.setZero(); }), HasSubstr("not of length 1"));
  EXPECT_THAT(message([](Joint& j, Scene&) { j.low = 0.6; }), HasSubstr("exchange the limits"));
  EXPECT_THAT(message([](Joint& j, Scene&) { j.friction = FixedScalar{-1.0}; }), HasSubstr("friction"));
  EXPECT_THAT(message([](Joint& j, Scene& s) {
                s.joints.push_back(j);
                s.joints[1].name = "other";
                s.joints[1].parent = "block";
              }),
              HasSubstr("closed loop"));
  EXPECT_THAT(message([](Joint& j, Scene& s) {
                s.objects[0].held_by.reset();
                j.parent = "block";
                s.joints.push_back(j);
                s.joints[1].name = "other";
                s.joints[1].parent = "ball";
                s.joints[1].child = "block";
              }),
              HasSubstr("a loop"));
}

TEST(Joints, LooseOnesAreDropped) {
  Scene scene = jointed_scene();
  std::erase_if(scene.objects, [](const SceneObject& object) { return object.name == "ball"; });
  EXPECT_THAT(drop_loose_joints(scene), testing::ElementsAre("slide"));
  EXPECT_TRUE(scene.joints.empty());
}

TEST(Joints, OutcomesAskForPositions) {
  const Scene scene = jointed_scene();
  Outcome outcome{"open", "", {Condition{JointWithin{"slide", JointType::kSlider, 0.2}}}};
  ASSERT_TRUE(complete_outcome(scene, outcome).ok());
  EXPECT_EQ(outcome.object, "ball");
  ASSERT_TRUE(validate(scene, outcome).ok());
  const auto holds_at = [&](double position) {
    Trajectory run;
    run.states.push_back(mean_start(scene));
    const Pose X_WT = scene.supports[static_cast<std::size_t>(*find_support(scene, "table"))].X_WS;
    run.states[0].objects[static_cast<std::size_t>(*find_object(scene, "ball"))].X_WO =
        child_pose(scene.joints[0], X_WT, position);
    return holds(scene, run, outcome);
  };
  EXPECT_TRUE(holds_at(0.3));
  EXPECT_FALSE(holds_at(0.1));
  EXPECT_EQ(*outcome_from_json(to_json(outcome)), outcome);

  outcome.all_of[0].predicate = JointWithin{"slide", JointType::kSlider, 0.6};
  EXPECT_THAT(validate(scene, outcome).message(), HasSubstr("never gets there"));
  outcome.all_of[0].predicate = JointWithin{"slide", JointType::kHinge, 0.1, 0.2};
  EXPECT_THAT(validate(scene, outcome).message(), HasSubstr("a slider: give 'min'"));
  outcome.all_of[0].predicate = JointWithin{"side", JointType::kSlider, 0.1};
  EXPECT_THAT(validate(scene, outcome).message(), HasSubstr("no joint 'side'"));
  const Outcome hinge{"up", "ball", {Condition{JointWithin{"h", JointType::kHinge, geometry::kDegree * 10.0}}}};
  EXPECT_EQ(*outcome_from_json(to_json(hinge)), hinge);
}

TEST(Joints, BeliefsTellPositionsWithTheirDeviation) {
  Scene scene = jointed_scene();
  const auto ball = static_cast<std::size_t>(*find_object(scene, "ball"));
  const Pose X_WT = scene.supports[static_cast<std::size_t>(*find_support(scene, "table"))].X_WS;
  geometry::Matrix6d covariance = geometry::Matrix6d::Zero();
  covariance.diagonal() << 1e-4, 1e-4, 1e-4, 4e-6, 4e-6, 4e-6;
  scene.objects[ball].pose = NormalPose{child_pose(scene.joints[0], X_WT, 0.25), covariance};
  scene.joints[0].anchor_P = scene.joints[0].X_PC0.translation;  // at the ball's origin: turns do not count
  const std::vector<JointEstimate> estimates = joint_estimates(scene);
  ASSERT_EQ(estimates.size(), 1u);
  EXPECT_NEAR(estimates[0].position, 0.25, 1e-9);
  EXPECT_NEAR(estimates[0].standard_deviation, 0.002, 1e-6);
  EXPECT_EQ(estimates[0].high, 0.5);
}

}  // namespace
}  // namespace prescene::belief::joint_laws_test
