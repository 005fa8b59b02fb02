// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "prescene/interfaces/scene_files/robot_description.h"

namespace prescene::interfaces {
namespace {

using geometry::Pose;

double start_position(const RobotKinematics& robot, const RobotJoint& joint) {
  const auto known = robot.positions.find(joint.name);
  if (known != robot.positions.end()) return known->second;
  const bool leaves_out_zero = joint.lower && joint.upper && (*joint.lower > 0.0 || *joint.upper < 0.0);
  return leaves_out_zero ? 0.5 * (*joint.lower + *joint.upper) : 0.0;
}

}  // namespace

Pose joint_pose(const RobotJoint& joint, double q) {
  switch (joint.kind) {
    case RobotJoint::Kind::kRevolute:
    case RobotJoint::Kind::kContinuous:
      return joint.X_PJ * Pose{geometry::exp_rotation(q * joint.axis_J), geometry::Vector3d::Zero()};
    case RobotJoint::Kind::kPrismatic:
      return joint.X_PJ * Pose::from_translation(q * joint.axis_J);
    case RobotJoint::Kind::kFixed:
    case RobotJoint::Kind::kOther:
      break;
  }
  return joint.X_PJ;
}

const RobotJoint* RobotKinematics::find_joint(std::string_view name) const {
  const auto found =
      std::find_if(joints.begin(), joints.end(), [&](const RobotJoint& joint) { return joint.name == name; });
  return found == joints.end() ? nullptr : &*found;
}

std::map<std::string, double> joint_positions(const RobotKinematics& robot,
                                              const std::map<std::string, double>& given) {
  std::map<std::string, double> positions;
  for (const RobotJoint& joint : robot.joints) {
    if (!joint.is_moving()) continue;
    const auto known = given.find(joint.name);
    positions[joint.name] = known != given.end() ? known->second : start_position(robot, joint);
  }
  for (const RobotJoint& joint : robot.joints) {
    if (!joint.mimic || given.contains(joint.name) || robot.positions.contains(joint.name)) continue;
    positions[joint.name] = joint.mimic->multiplier * positions[joint.mimic->joint] + joint.mimic->offset;
  }
  return positions;
}

std::map<std::string, Pose> link_poses(const RobotKinematics& robot, const std::map<std::string, double>& given) {
  const std::map<std::string, double> positions = joint_positions(robot, given);
  std::map<std::string, Pose> X_RL{{robot.root, Pose::identity()}};
  for (const RobotJoint& joint : robot.joints) {
    const auto q = positions.find(joint.name);
    X_RL[joint.child] =
        geometry::normalized(X_RL[joint.parent] * joint_pose(joint, q == positions.end() ? 0.0 : q->second));
  }
  return X_RL;
}

}  // namespace prescene::interfaces
