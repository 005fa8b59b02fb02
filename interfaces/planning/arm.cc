// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/planning/arm.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

namespace prescene::interfaces {
namespace {

using geometry::Pose;

/// Where the robot's joint is taken from where it has no limits; `sliders`, m.
constexpr double kSliderRange = 1.0;

Arm::JointRange range_of(const RobotJoint& joint) {
  const double free = joint.kind == RobotJoint::Kind::kPrismatic ? kSliderRange : std::numbers::pi;
  return {joint.name, joint.lower.value_or(-free), joint.upper.value_or(free)};
}

core::Result<std::vector<std::string>> chosen_joints(const RobotKinematics& robot, const ArmOptions& options) {
  std::vector<std::string> names = options.joints;
  if (names.empty()) {
    for (const RobotJoint& joint : robot.joints)
      if (joint.is_moving() && !joint.mimic) names.push_back(joint.name);
  }
  if (names.empty()) return core::invalid_input(robot.file + ": no joint moves: nothing is there to plan for");
  for (const std::string& name : names) {
    const RobotJoint* joint = robot.find_joint(name);
    const std::string place = robot.file + ": joint '" + name + "': ";
    if (joint == nullptr) return core::invalid_input(place + "there is none of this name: name joints of the robot");
    if (!joint->is_moving()) return core::invalid_input(place + "it does not move by one number: leave it out");
    if (joint->mimic) return core::invalid_input(place + "it mimics '" + joint->mimic->joint + "': name that instead");
    if (std::count(names.begin(), names.end(), name) > 1)
      return core::invalid_input(place + "it is named twice: name it once");
  }
  return names;
}

}  // namespace

core::Status Arm::take_joints(const RobotKinematics& robot, const ArmOptions& options) {
  PRESCENE_TRY(const auto names, chosen_joints(robot, options));
  const std::map<std::string, double> positions = joint_positions(robot, {});
  const auto axis_of = [&](const std::string& name) -> std::optional<std::size_t> {
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end()) return std::nullopt;
    return static_cast<std::size_t>(found - names.begin());
  };
  for (const std::string& name : names) {
    ranges_.push_back(range_of(*robot.find_joint(name)));
    home_.push_back(std::clamp(positions.at(name), ranges_.back().lower, ranges_.back().upper));
  }
  links_ = {robot.root};
  for (const RobotJoint& joint : robot.joints) {
    Step step;
    step.joint = joint;
    step.parent = static_cast<std::size_t>(std::find(links_.begin(), links_.end(), joint.parent) - links_.begin());
    if (step.parent == links_.size())
      return core::invalid_input(robot.file + ": joint '" + joint.name + "': its parent link '" + joint.parent +
                                 "' comes after it: list parents first");
    step.axis = axis_of(joint.mimic ? joint.mimic->joint : joint.name);
    // A joint that the scene places by itself does not follow.
    if (joint.mimic && robot.positions.contains(joint.name)) step.axis.reset();
    if (step.axis && joint.mimic) {
      step.multiplier = joint.mimic->multiplier;
      step.offset = joint.mimic->offset;
    } else if (!step.axis && joint.is_moving()) {
      step.offset = positions.at(joint.name);
    }
    links_.push_back(joint.child);
    steps_.push_back(std::move(step));
  }
  return core::ok_status();
}

core::Status Arm::take_shapes(const RobotKinematics& robot, const belief::Scene& scene, core::ThreadPool& pool) {
  for (const belief::KinematicBody& body : scene.robot) {
    const auto link = std::find(links_.begin(), links_.end(), body.name);
    if (link == links_.end() || body.collision.empty()) continue;
    PRESCENE_TRY(PlanningShape shape, PlanningShape::of_shapes(body.collision, body.name, pool));
    shapes_.push_back({body.name, std::move(shape)});
    attachments_.push_back({static_cast<std::size_t>(link - links_.begin()), Pose::identity()});
  }
  // Objects are held as the scene has the robot stand, also where that is beyond a limit.
  const auto X_RL = link_poses(robot, {});
  const belief::WorldState start = belief::mean_start(scene);
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const belief::SceneObject& object = scene.objects[i];
    const auto link = object.held_by ? std::find(links_.begin(), links_.end(), *object.held_by) : links_.end();
    if (link == links_.end()) continue;
    PRESCENE_TRY(PlanningShape shape, PlanningShape::of_shapes(scene.model_of(object).collision, object.name, pool));
    shapes_.push_back({object.name, std::move(shape)});
    attachments_.push_back(
        {static_cast<std::size_t>(link - links_.begin()), (X_WR_ * X_RL.at(*link)).inverse() * start.objects[i].X_WO});
  }
  for (std::size_t i = 0; i < shapes_.size(); ++i)
    if (moves(i)) return core::ok_status();
  return core::invalid_input(robot.file + ": no link that moves has a shape: give it <collision> or <visual>");
}

core::Result<std::shared_ptr<const Arm>> Arm::make(const RobotKinematics& robot, const belief::Scene& scene,
                                                   const ArmOptions& options, core::ThreadPool& pool) {
  std::shared_ptr<Arm> arm(new Arm());
  arm->X_WR_ = robot.X_WR.value_or(Pose::identity());
  arm->own_collisions_ = options.own_collisions;
  PRESCENE_RETURN_IF_ERROR(arm->take_joints(robot, options));
  PRESCENE_RETURN_IF_ERROR(arm->take_shapes(robot, scene, pool));
  return std::shared_ptr<const Arm>(std::move(arm));
}

std::vector<std::string> Arm::bodies() const {
  std::vector<std::string> names;
  for (const MovingShape& shape : shapes_) names.push_back(shape.name);
  return names;
}

void Arm::place_links(std::span<const double> q, std::vector<Pose>* X_WL) const {
  X_WL->resize(steps_.size() + 1);
  X_WL->front() = X_WR_;
  for (std::size_t i = 0; i < steps_.size(); ++i) {
    const Step& step = steps_[i];
    (*X_WL)[i + 1] = geometry::normalized((*X_WL)[step.parent] * joint_pose(step.joint, position(step, q)));
  }
}

void Arm::place(std::span<const double> q, std::span<Pose> X_WS, std::vector<Pose>* work) const {
  place_links(q, work);
  for (std::size_t i = 0; i < attachments_.size(); ++i) X_WS[i] = (*work)[attachments_[i].link] * attachments_[i].X_LS;
}

void Arm::between(std::span<const double> q0, std::span<const double> q1, double t, std::span<double> q) const {
  for (std::size_t i = 0; i < dimension(); ++i) q[i] = q0[i] + t * (q1[i] - q0[i]);
}

bool Arm::carries(std::size_t step, std::size_t link) const {
  for (; link > 0; link = steps_[link - 1].parent)
    if (link - 1 == step) return true;
  return false;
}

double Arm::way(std::size_t shape, std::optional<std::size_t> other, std::span<const double> q0,
                std::span<const double> q1) const {
  // From the link down to the root: how far the shape's points are, at most, from the joint's place.
  const Attachment& attachment = attachments_[shape];
  double reach = attachment.X_LS.translation.norm() + shapes_[shape].shape.reach();
  double way = 0.0;
  for (std::size_t link = attachment.link; link > 0; link = steps_[link - 1].parent) {
    const Step& step = steps_[link - 1];
    if (other && carries(link - 1, attachments_[*other].link)) break;
    const double from = position(step, q0), to = position(step, q1);
    reach += step.joint.kind == RobotJoint::Kind::kPrismatic ? std::max(std::abs(from), std::abs(to)) : 0.0;
    if (step.axis) way += std::abs(to - from) * (step.joint.kind == RobotJoint::Kind::kPrismatic ? 1.0 : reach);
    reach += step.joint.X_PJ.translation.norm();
  }
  return way;
}

bool Arm::moves(std::size_t shape) const {
  for (std::size_t link = attachments_[shape].link; link > 0; link = steps_[link - 1].parent)
    if (steps_[link - 1].axis) return true;
  return false;
}

std::vector<std::pair<std::size_t, std::size_t>> Arm::own_pairs() const {
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  if (!own_collisions_) return pairs;
  for (std::size_t a = 0; a < shapes_.size(); ++a) {
    for (std::size_t b = a + 1; b < shapes_.size(); ++b) {
      int between = 0;
      for (std::size_t i = 0; i < steps_.size(); ++i)
        between += steps_[i].axis && carries(i, attachments_[a].link) != carries(i, attachments_[b].link);
      if (between > 1) pairs.emplace_back(a, b);
    }
  }
  return pairs;
}

}  // namespace prescene::interfaces
