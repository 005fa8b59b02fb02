// SPDX-License-Identifier: Apache-2.0
// A robot from a URDF as a planner moves it: each link that has a body in the scene, and what is held by one.
//
//   PRESCENE_TRY(const auto robot, parse_robot_kinematics(text, "scene.yaml"));
//   PRESCENE_TRY(const auto arm, Arm::make(*robot, scene, {}, pool));
//   ... arm->joints(), arm->home()
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "prescene/belief/scene.h"
#include "prescene/interfaces/planning/mover.h"
#include "prescene/interfaces/scene_files/robot_description.h"

namespace prescene::interfaces {

struct ArmOptions {
  /// The joints that are planned for, in the order of a configuration; empty: all that move and mimic none, in the
  /// robot's order. The others stay as joint_positions() has them.
  std::vector<std::string> joints;
  /// Whether links must not meet each other. Never looked at are two links with one moving joint or none between them.
  bool own_collisions = true;
};

/// A configuration is the positions (rad, m) of its joints; in a motion all of them change at a steady rate.
class Arm final : public Mover {
 public:
  /// Fails with kInvalidInput when a joint is unknown, does not move, mimics another or is named twice, when there is
  /// none, or when no link that moves has a shape.
  static core::Result<std::shared_ptr<const Arm>> make(const RobotKinematics& robot, const belief::Scene& scene,
                                                       const ArmOptions& options, core::ThreadPool& pool);

  struct JointRange {
    std::string name;
    double lower, upper;  ///< A joint without limits: -pi to pi of an angle, -1 m to 1 m of a slider.
  };
  const std::vector<JointRange>& joints() const { return ranges_; }
  /// Where the scene has the joints, within their range.
  const std::vector<double>& home() const { return home_; }
  /// Names of the scene's bodies and objects that move, or stand, with the robot: no obstacles.
  std::vector<std::string> bodies() const;
  /// X_WL of all links, as link_poses() has them, by number.
  void place_links(std::span<const double> q, std::vector<geometry::Pose>* X_WL) const;

  std::size_t dimension() const override { return ranges_.size(); }
  void place(std::span<const double> q, std::span<geometry::Pose> X_WS,
             std::vector<geometry::Pose>* work) const override;
  void between(std::span<const double> q0, std::span<const double> q1, double t, std::span<double> q) const override;
  double way(std::size_t shape, std::optional<std::size_t> other, std::span<const double> q0,
             std::span<const double> q1) const override;
  bool moves(std::size_t shape) const override;
  std::vector<std::pair<std::size_t, std::size_t>> own_pairs() const override;

 private:
  struct Step {
    RobotJoint joint;
    std::size_t parent = 0;           // Links: 0 is the root, i + 1 the child of step i.
    std::optional<std::size_t> axis;  // Number in the configuration, if it moves with one.
    double multiplier = 1.0;
    double offset = 0.0;  // Its position where it moves with none.
  };
  struct Attachment {
    std::size_t link = 0;
    geometry::Pose X_LS;
  };

  Arm() = default;
  double position(const Step& step, std::span<const double> q) const {
    return step.axis ? step.multiplier * q[*step.axis] + step.offset : step.offset;
  }
  bool carries(std::size_t step, std::size_t link) const;
  core::Status take_joints(const RobotKinematics& robot, const ArmOptions& options);
  core::Status take_shapes(const RobotKinematics& robot, const belief::Scene& scene, core::ThreadPool& pool);

  geometry::Pose X_WR_;
  std::vector<Step> steps_;
  std::vector<Attachment> attachments_;  // Of each shape.
  std::vector<JointRange> ranges_;
  std::vector<double> home_;
  std::vector<std::string> links_;
  bool own_collisions_ = true;
};

}  // namespace prescene::interfaces
