// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/tracking/joint_transforms.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/interfaces/ros_messages/conversions.h"
#include "prescene/service/tracking/frame_assembler.h"

namespace prescene::service::joint_transforms_test {
namespace {

using geometry::Pose;
using geometry::Vector3d;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr core::TimeNs kMs = 1'000'000;
constexpr core::TimeNs kSecond = 1000 * kMs;

// A mast that turns, an arm of 0.5 m on it that lifts, a gripper whose fingers mimic each other, and a camera.
constexpr const char* kUrdf = R"(<robot name="r">
  <link name="base"/><link name="mast"/><link name="arm"/><link name="hand"/><link name="left"/><link name="right"/>
  <link name="camera"/>
  <joint name="turn" type="continuous"><parent link="base"/><child link="mast"/>
    <origin xyz="0 0 0.4"/><axis xyz="0 0 1"/></joint>
  <joint name="lift" type="revolute"><parent link="mast"/><child link="arm"/><axis xyz="0 -1 0"/>
    <limit lower="-1" upper="1"/></joint>
  <joint name="wrist" type="fixed"><parent link="arm"/><child link="hand"/><origin xyz="0.5 0 0"/></joint>
  <joint name="open" type="prismatic"><parent link="hand"/><child link="left"/><axis xyz="0 1 0"/>
    <limit lower="0" upper="0.04"/></joint>
  <joint name="follow" type="prismatic"><parent link="hand"/><child link="right"/><axis xyz="0 -1 0"/>
    <mimic joint="open"/></joint>
  <joint name="mount" type="fixed"><parent link="hand"/><child link="camera"/><origin xyz="0 0 0.1"/></joint>
</robot>)";

std::shared_ptr<const interfaces::RobotKinematics> robot(const std::string& more = "  pose: {position: [1, 0, 0]}\n") {
  interfaces::SceneFileOptions options;
  options.read_file = [](const std::filesystem::path&) -> core::Result<std::vector<std::uint8_t>> {
    const std::string text = kUrdf;
    return std::vector<std::uint8_t>(text.begin(), text.end());
  };
  auto robot = interfaces::parse_robot_kinematics("robot_description:\n  file: r.urdf\n" + more, "s.yaml", options);
  EXPECT_TRUE(robot.ok()) << robot.status().message();
  return robot ? *robot : nullptr;
}

interfaces::RosJointState state(core::TimeNs stamp_ns, const std::map<std::string, double>& positions) {
  interfaces::RosJointState message;
  message.header.stamp = interfaces::to_ros_time(stamp_ns);
  for (const auto& [name, q] : positions) {
    message.name.push_back(name);
    message.position.push_back(q);
  }
  return message;
}

/// Where the hand is, worked out by hand.
Vector3d hand_at(double turn, double lift) {
  return {1.0 + 0.5 * std::cos(lift) * std::cos(turn), 0.5 * std::cos(lift) * std::sin(turn),
          0.4 + 0.5 * std::sin(lift)};
}

TEST(JointTransforms, PutsEveryLinkWhereTheJointsHaveIt) {
  TfBuffer tf;
  JointTransforms joints(robot());
  ASSERT_TRUE(joints.add(state(kSecond, {{"turn", 0.7}, {"lift", 0.3}, {"open", 0.02}}), "world", tf).ok());
  const auto hand = tf.lookup("world", "hand", kSecond);
  ASSERT_TRUE(hand.ok()) << hand.status().message();
  EXPECT_LT((hand->translation - hand_at(0.7, 0.3)).norm(), 1e-12);
  const auto fingers = tf.lookup("left", "right", kSecond);
  ASSERT_TRUE(fingers.ok());
  EXPECT_LT((fingers->translation - Vector3d(0.0, -0.04, 0.0)).norm(), 1e-12) << "one mimics the other";
  EXPECT_TRUE(tf.lookup("world", "camera", kSecond).ok());
  EXPECT_THAT(joints.missing(), IsEmpty());
  // All of it at once: forward kinematics.
  const auto X_RL = interfaces::link_poses(*robot(), {{"turn", 0.7}, {"lift", 0.3}, {"open", 0.02}});
  for (const auto& [link, X] : X_RL) {
    const auto told = tf.lookup("base", link, kSecond);
    ASSERT_TRUE(told.ok()) << link;
    EXPECT_LT((told->translation - X.translation).norm(), 1e-12) << link;
    EXPECT_LT(geometry::angle_between(told->rotation, X.rotation), 1e-7) << link;
  }
}

TEST(JointTransforms, JointsOfSeveralPublishersAreInterpolatedEach) {
  TfBuffer tf;
  JointTransforms joints(robot());
  ASSERT_TRUE(joints.add(state(kSecond, {{"turn", 0.0}}), "world", tf).ok());
  ASSERT_TRUE(joints.add(state(kSecond + 40 * kMs, {{"turn", 0.4}}), "world", tf).ok());
  ASSERT_TRUE(joints.add(state(kSecond - 10 * kMs, {{"lift", 0.2}, {"elsewhere", 5.0}}), "world", tf).ok());
  ASSERT_TRUE(joints.add(state(kSecond + 30 * kMs, {{"lift", 0.6}}), "world", tf).ok());
  const auto hand = tf.lookup("world", "hand", kSecond + 10 * kMs);
  ASSERT_TRUE(hand.ok()) << hand.status().message();
  EXPECT_LT((hand->translation - hand_at(0.1, 0.4)).norm(), 1e-12);
  EXPECT_THAT(joints.missing(), ElementsAre("open", "follow"));
  EXPECT_THAT(joints.doubts(kSecond + 500 * kMs), IsEmpty()) << "another publisher may start later";
  EXPECT_THAT(joints.doubts(3 * kSecond), ElementsAre(HasSubstr("'open', 'follow' are")));
}

TEST(JointTransforms, WhatNobodyTellsIsWhereTheSceneFileHasIt) {
  TfBuffer tf;
  JointTransforms joints(robot("  pose: {position: [1, 0, 0]}\n  joint_positions: {open: 0.01, follow: 0.03}\n"));
  ASSERT_TRUE(joints.add(state(kSecond, {{"turn", 0.0}, {"lift", 0.0}}), "world", tf).ok());
  const auto fingers = tf.lookup("left", "right", kSecond);
  ASSERT_TRUE(fingers.ok());
  EXPECT_NEAR(fingers->translation.y(), -0.04, 1e-12);
  EXPECT_THAT(joints.missing(), IsEmpty());
  // Once it is told, it moves.
  ASSERT_TRUE(joints.add(state(2 * kSecond, {{"open", 0.04}}), "world", tf).ok());
  EXPECT_NEAR(tf.lookup("hand", "left", 2 * kSecond)->translation.y(), 0.04, 1e-12);
  EXPECT_FALSE(tf.lookup("hand", "left", 5 * kSecond).ok());
}

TEST(JointTransforms, TransformsOfTfTakePrecedence) {
  TfBuffer tf;
  JointTransforms joints(robot());
  ASSERT_TRUE(joints.add(state(kSecond, {{"turn", 0.0}, {"lift", 0.0}}), "world", tf).ok());
  // Somebody measured where the base is, on another frame than the scene's, and follows the mast.
  const Pose X_WB = Pose::from_translation({3.0, 0.0, 0.0});
  joints.give_way("base", tf);
  ASSERT_TRUE(tf.add("table", "base", 0, X_WB, true).ok()) << "and no parent stands against it";
  ASSERT_TRUE(tf.add("world", "table", 0, Pose(), true).ok());
  joints.give_way("mast", tf);
  ASSERT_TRUE(tf.add("base", "mast", kSecond, Pose::from_translation({0.0, 0.0, 0.8}), false).ok());
  ASSERT_TRUE(joints.add(state(kSecond + kMs, {{"turn", 1.0}, {"lift", 0.0}}), "world", tf).ok());
  const auto hand = tf.lookup("world", "hand", kSecond);
  ASSERT_TRUE(hand.ok()) << hand.status().message();
  EXPECT_LT((hand->translation - Vector3d(3.5, 0.0, 0.8)).norm(), 1e-12);
}

TEST(JointTransforms, RefusesWhatMakesNoSenseAndChangesNothing) {
  TfBuffer tf;
  JointTransforms joints(robot());
  auto message = state(kSecond, {{"lift", 0.0}, {"turn", 0.0}});
  message.position.pop_back();
  EXPECT_THAT(joints.add(message, "world", tf).message(), HasSubstr("1 values for 2 names"));
  message = state(kSecond, {{"lift", 0.0}, {"turn", std::numeric_limits<double>::quiet_NaN()}});
  EXPECT_THAT(joints.add(message, "world", tf).message(), HasSubstr("joint 'turn' is nan"));
  EXPECT_THAT(joints.add(state(kSecond, {{"turn", 1e6}}), "world", tf).message(), HasSubstr("radians or metres"));
  message = state(kSecond, {{"turn", 0.0}});
  message.name.push_back("turn");
  message.position.push_back(1.0);
  EXPECT_THAT(joints.add(message, "world", tf).message(), HasSubstr("comes twice"));
  message = state(kSecond, {{"turn", 0.0}});
  message.header.stamp.nanosec = 2'000'000'000;
  EXPECT_FALSE(joints.add(message, "world", tf).ok());
  EXPECT_FALSE(tf.knows("mast"));
  // Neither wheels without positions nor another robot's joints are of interest.
  message = state(kSecond, {{"turn", 0.0}});
  message.position.clear();
  EXPECT_TRUE(joints.add(message, "world", tf).ok());
  EXPECT_TRUE(joints.add(state(kSecond, {{"wheel", 7.0}, {"wrist", 1.0}}), "world", tf).ok());
  EXPECT_FALSE(tf.knows("mast"));
  EXPECT_EQ(joints.messages(), 0U);
  ASSERT_TRUE(joints.add(state(kSecond, {{"lift", 30.0}}), "world", tf).ok());
  EXPECT_THAT(joints.doubts(kSecond), ElementsAre(HasSubstr("'lift' far beyond")));
  ASSERT_TRUE(joints.add(state(kSecond + kMs, {{"lift", 0.5}, {"turn", 0.0}, {"open", 0.0}}), "world", tf).ok());
  EXPECT_THAT(joints.doubts(kSecond), IsEmpty());
  JointTransforms none(nullptr);
  EXPECT_TRUE(none.add(state(kSecond, {{"turn", 0.0}}), "world", tf).ok());
}

// A camera in the hand, and a body of the robot: both from joint states alone.
TEST(JointTransforms, FramesHaveCameraAndRobotFromJointStates) {
  AssemblerSettings settings;
  settings.use_color = false;
  settings.robot = robot();
  FrameAssembler assembler(settings, {"hand", "left"});
  const interfaces::RosHeader header{interfaces::to_ros_time(kSecond + 10 * kMs), "camera"};
  ASSERT_TRUE(assembler.add_camera_info(interfaces::to_ros_camera_info({8, 6, 10.0, 10.0, 3.5, 2.5}, header), 1).ok());
  ASSERT_TRUE(assembler.add_joint_state(state(kSecond, {{"turn", 0.0}, {"lift", 0.0}, {"open", 0.01}}), 2).ok());
  ASSERT_TRUE(
      assembler
          .add_depth(interfaces::to_ros_image_16uc1(geometry::DepthImage(8, 6, 0.75F), header), 3, kSecond + 11 * kMs)
          .ok());
  ASSERT_TRUE(
      assembler.add_joint_state(state(kSecond + 20 * kMs, {{"turn", 0.2}, {"lift", 0.0}, {"open", 0.03}}), 4).ok());
  const auto frame = assembler.take(kSecond + 21 * kMs);
  ASSERT_TRUE(frame.has_value()) << assembler.last_skip();
  EXPECT_EQ(frame->tf_until, 4U);
  EXPECT_LT((frame->observation.X_WC.translation - hand_at(0.1, 0.0) - Vector3d(0.0, 0.0, 0.1)).norm(), 1e-12);
  EXPECT_LT((frame->observation.robot.at("hand").translation - hand_at(0.1, 0.0)).norm(), 1e-12);
  EXPECT_NEAR((frame->observation.robot.at("left").translation - hand_at(0.1, 0.0)).norm(), 0.02, 1e-12);
}

}  // namespace
}  // namespace prescene::service::joint_transforms_test
