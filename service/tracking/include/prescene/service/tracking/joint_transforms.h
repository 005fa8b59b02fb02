// SPDX-License-Identifier: Apache-2.0
// Joint states as transforms: what ROS's robot_state_publisher does, for robots whose tf nobody publishes.
//
//   JointTransforms joints(robot);                      // of interfaces::parse_robot_kinematics; null: does nothing
//   PRESCENE_RETURN_IF_ERROR(joints.add(joint_state, "world", tf));
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "prescene/interfaces/ros_messages/messages.h"
#include "prescene/interfaces/scene_files/robot_description.h"
#include "prescene/service/tracking/tf_buffer.h"

namespace prescene::service {

/// Each joint's transform, parent link to child link, goes into the tf buffer by itself: links that move at different
/// times, or that come in different messages, are interpolated as all frames of tf are. A transform that tf
/// contains takes precedence over that of a joint, from then on.
class JointTransforms {
 public:
  explicit JointTransforms(std::shared_ptr<const interfaces::RobotKinematics> robot) : robot_(std::move(robot)) {}

  bool has_robot() const { return robot_ != nullptr; }
  /// Puts a message's positions into `tf`, with those of joints that mimic others. Before the first, the joints that do
  /// not move, those that the scene file gives positions, and the root link's pose in `world` where it gives one; so
  /// nothing is known of the links until a message comes. Names that the robot does not have are passed over.
  /// kInvalidInput, changing nothing, where positions are not as many as names, not finite, or out of all reach, or a
  /// name comes twice. Errors of TfBuffer::add.
  core::Status add(const interfaces::RosJointState& message, const std::string& world, TfBuffer& tf);
  /// To be called before tf's own transform of `child` is added: this class then keeps away from it.
  void give_way(const std::string& child, TfBuffer& tf);
  /// The clock went back: what is static goes in again with the next message.
  void begin_again() { begun_ = false; }

  /// What a person should know at this time, in sentences: joints whose position nobody publishes, and positions far
  /// beyond the limits of a joint. Empty without a robot, and while all is well.
  std::vector<std::string> doubts(core::TimeNs stamp_ns) const;
  /// Joints that move, of which no position came and which have none in the scene file.
  std::vector<std::string> missing() const;
  /// Messages that held at least one joint's position.
  std::uint64_t messages() const { return messages_; }

 private:
  core::Status begin(core::TimeNs stamp_ns, const std::string& world, TfBuffer& tf);
  core::Status set(const interfaces::RobotJoint& joint, double q, core::TimeNs stamp_ns, bool is_static, TfBuffer& tf);
  bool is_reported(const interfaces::RobotJoint& joint) const { return reported_.contains(joint.name); }

  std::shared_ptr<const interfaces::RobotKinematics> robot_;
  bool begun_ = false;
  core::TimeNs begun_ns_ = 0;  // stamp of the first message
  std::uint64_t messages_ = 0;
  std::set<std::string> reported_;  // joints
  std::set<std::string> of_tf_;     // links whose transforms come from tf
  std::set<std::string> assumed_;   // joints at the scene file's position, of which nothing has come
  std::set<std::string> beyond_;    // joints whose last position was far beyond its limits
};

}  // namespace prescene::service
