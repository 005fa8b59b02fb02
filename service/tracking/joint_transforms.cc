// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/tracking/joint_transforms.h"

#include <cmath>

#include "prescene/interfaces/bytes/text.h"
#include "prescene/interfaces/ros_messages/conversions.h"

namespace prescene::service {
namespace {

using interfaces::RobotJoint;

// No joint turns or slides farther; a number beyond it is no position.
constexpr double kFarthest = 1e5;
// Of a joint's range, by which a calibration may be off. Degrees for radians are beyond it by far.
constexpr double kSlack = 0.2;
// How long a second publisher of joint states may take to be heard.
constexpr core::TimeNs kPatienceNs = 1'000'000'000;
constexpr std::size_t kNamed = 5;

std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < std::min(names.size(), kNamed); ++i)
    text += (i == 0 ? "" : ", ") + interfaces::quote(names[i]);
  return names.size() > kNamed ? text + " and " + std::to_string(names.size() - kNamed) + " more" : text;
}

bool is_far_beyond(const RobotJoint& joint, double q) {
  if (!joint.lower || !joint.upper) return false;
  const double slack = kSlack * (*joint.upper - *joint.lower) + 1e-3;
  return q < *joint.lower - slack || q > *joint.upper + slack;
}

core::Result<std::map<std::string, double>> positions_of(const interfaces::RosJointState& message) {
  const std::size_t count = message.name.size();
  if (message.position.size() != count && !message.position.empty())
    return core::invalid_input("position: " + std::to_string(message.position.size()) + " values for " +
                               std::to_string(count) + " names: correct the publisher");
  std::map<std::string, double> positions;
  for (std::size_t i = 0; i < message.position.size(); ++i) {
    const std::string at = "position[" + std::to_string(i) + "] of joint " + interfaces::quote(message.name[i]);
    if (!std::isfinite(message.position[i]) || std::abs(message.position[i]) > kFarthest)
      return core::invalid_input(at + " is " + interfaces::number_text(message.position[i]) +
                                 ": give radians or metres");
    if (!positions.emplace(message.name[i], message.position[i]).second)
      return core::invalid_input(at + ": the name comes twice: correct the publisher");
  }
  return positions;
}

}  // namespace

core::Status JointTransforms::add(const interfaces::RosJointState& message, const std::string& world, TfBuffer& tf) {
  if (!robot_) return core::ok_status();
  PRESCENE_TRY(const core::TimeNs stamp_ns, interfaces::to_stamp_ns(message.header.stamp));
  PRESCENE_TRY(const auto positions, positions_of(message));
  bool is_ours = false;
  for (const RobotJoint& joint : robot_->joints)
    is_ours = is_ours || (joint.is_moving() && positions.contains(joint.name));
  if (!is_ours) return core::ok_status();
  if (!begun_) PRESCENE_RETURN_IF_ERROR(begin(stamp_ns, world, tf));
  ++messages_;
  core::Status first_bad;
  for (const RobotJoint& joint : robot_->joints) {
    if (!joint.is_moving()) continue;
    const auto reported = positions.find(joint.name);
    const auto source = joint.mimic ? positions.find(joint.mimic->joint) : positions.end();
    double q = 0.0;
    if (reported != positions.end())
      q = reported->second;
    else if (source != positions.end() && !robot_->positions.contains(joint.name))
      q = joint.mimic->multiplier * source->second + joint.mimic->offset;
    else
      continue;
    if (assumed_.erase(joint.name) > 0 && !of_tf_.contains(joint.child)) tf.forget(joint.child);
    reported_.insert(joint.name);
    if (is_far_beyond(joint, q))
      beyond_.insert(joint.name);
    else
      beyond_.erase(joint.name);
    core::Status added = set(joint, q, stamp_ns, false, tf);
    if (!added.ok() && first_bad.ok()) first_bad = std::move(added);
  }
  return first_bad;
}

core::Status JointTransforms::begin(core::TimeNs stamp_ns, const std::string& world, TfBuffer& tf) {
  begun_ = true;
  begun_ns_ = stamp_ns;
  core::Status first_bad;
  const auto keep = [&first_bad](core::Status status) {
    if (!status.ok() && first_bad.ok()) first_bad = std::move(status);
  };
  if (robot_->X_WR && robot_->root != world && !of_tf_.contains(robot_->root))
    keep(tf.add(world, robot_->root, stamp_ns, *robot_->X_WR, true));
  for (const RobotJoint& joint : robot_->joints) {
    const auto assumed = robot_->positions.find(joint.name);
    if (joint.kind == RobotJoint::Kind::kFixed) {
      keep(set(joint, 0.0, stamp_ns, true, tf));
    } else if (joint.is_moving() && assumed != robot_->positions.end() && !is_reported(joint)) {
      assumed_.insert(joint.name);
      keep(set(joint, assumed->second, stamp_ns, true, tf));
    }
  }
  return first_bad;
}

core::Status JointTransforms::set(const RobotJoint& joint, double q, core::TimeNs stamp_ns, bool is_static,
                                  TfBuffer& tf) {
  if (of_tf_.contains(joint.child)) return core::ok_status();
  return tf.add(joint.parent, joint.child, stamp_ns, geometry::normalized(interfaces::joint_pose(joint, q)), is_static);
}

void JointTransforms::give_way(const std::string& child, TfBuffer& tf) {
  if (!robot_ || of_tf_.contains(child)) return;
  bool is_link = child == robot_->root;
  for (const RobotJoint& joint : robot_->joints) is_link = is_link || joint.child == child;
  if (!is_link) return;
  of_tf_.insert(child);
  if (begun_) tf.forget(child);
}

std::vector<std::string> JointTransforms::missing() const {
  std::vector<std::string> names;
  if (!robot_) return names;
  for (const RobotJoint& joint : robot_->joints)
    if (joint.is_moving() && !is_reported(joint) && !robot_->positions.contains(joint.name) &&
        !of_tf_.contains(joint.child))
      names.push_back(joint.name);
  return names;
}

std::vector<std::string> JointTransforms::doubts(core::TimeNs stamp_ns) const {
  std::vector<std::string> sentences;
  if (!begun_) return sentences;
  const std::vector<std::string> unknown = missing();
  if (!unknown.empty() && stamp_ns - begun_ns_ > kPatienceNs)
    sentences.push_back("no joint state says where " + listed(unknown) + (unknown.size() == 1 ? " is" : " are") +
                        ", so the links behind stay where they were: publish it, or give it under "
                        "robot_description.joint_positions");
  if (!beyond_.empty())
    sentences.push_back("joint states have " + listed({beyond_.begin(), beyond_.end()}) +
                        " far beyond the limits of the URDF: give radians and metres, or correct the limits");
  return sentences;
}

}  // namespace prescene::service
