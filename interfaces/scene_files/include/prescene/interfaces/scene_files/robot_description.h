// SPDX-License-Identifier: Apache-2.0
// How the links of a robot hang together: what a URDF file, which a scene names under `robot_description`, says of its
// joints. The links' shapes are bodies of the scene (belief::Scene::robot), named after their links.
//
//   PRESCENE_TRY(const auto robot, parse_robot_kinematics(text, "scene.yaml"));   // null: the scene names none
//   const auto X_RL = link_poses(*robot, {{"panda_joint1", 0.3}});                // by the names of the links
//   const geometry::Pose X_WL = robot->X_WR.value_or(geometry::Pose()) * X_RL.at("panda_hand");
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "prescene/core/status.h"
#include "prescene/geometry/pose.h"
#include "prescene/interfaces/scene_files/scene_file.h"

namespace prescene::interfaces {

/// One joint: the frame of its child link C in that of its parent link P, as a function of one number q.
struct RobotJoint {
  enum class Kind {
    kFixed,
    kRevolute,    ///< q is an angle in radians, within limits.
    kContinuous,  ///< The same without limits.
    kPrismatic,   ///< q is a distance in metres.
    kOther,       ///< Floating or planar: one number does not say where it is, only tf can.
  };
  std::string name, parent, child;
  Kind kind = Kind::kFixed;
  geometry::Pose X_PJ;                                        ///< Of the joint: X_PC at q = 0.
  geometry::Vector3d axis_J = geometry::Vector3d(1.0, 0, 0);  ///< Unit vector, along or about which it moves.
  std::optional<double> lower, upper;                         ///< Limits of q.
  /// q = multiplier times that of another joint, which mimics none itself, plus offset.
  struct Mimic {
    std::string joint;
    double multiplier = 1.0;
    double offset = 0.0;
  };
  std::optional<Mimic> mimic;

  bool is_moving() const { return kind != Kind::kFixed && kind != Kind::kOther; }
};

/// X_PC at q.
geometry::Pose joint_pose(const RobotJoint& joint, double q);

struct RobotKinematics {
  std::string file;                ///< Of the URDF, for messages.
  std::string root;                ///< The link that is no joint's child.
  std::vector<RobotJoint> joints;  ///< Parents before children.
  /// Pose of the root link in the world where the scene file says it; else tf has to, or the two are one frame.
  std::optional<geometry::Pose> X_WR;
  /// By joint: where the scene file has it at the start, and for as long as nobody says otherwise.
  std::map<std::string, double> positions;

  const RobotJoint* find_joint(std::string_view name) const;
};

/// q of every joint that moves: as given, or as it mimics another; else the scene file's; else 0, or the middle of its
/// limits where they leave 0 out.
std::map<std::string, double> joint_positions(const RobotKinematics& robot, const std::map<std::string, double>& given);

/// Forward kinematics: X_RL of every link L in the root link's frame R, at these joint positions (rad, m) and those of
/// joint_positions(). A joint of the kind kOther is at its X_PJ.
std::map<std::string, geometry::Pose> link_poses(const RobotKinematics& robot,
                                                 const std::map<std::string, double>& given);

/// What the text of a scene file says under `robot_description`, and the URDF that it names (through
/// options.read_file); null if it has no such key. `file` as for parse_scene. Errors of parse_yaml and read_file;
/// kInvalidInput with all that is wrong, as parse_scene reports it.
core::Result<std::shared_ptr<const RobotKinematics>> parse_robot_kinematics(std::string_view text,
                                                                            const std::string& file,
                                                                            const SceneFileOptions& options = {});

}  // namespace prescene::interfaces
