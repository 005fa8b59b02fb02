// SPDX-License-Identifier: Apache-2.0
// URDF, the XML in which ROS describes robots: links with shapes, and the joints between them.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "prescene/belief/object_model.h"
#include "prescene/interfaces/scene_files/problems.h"
#include "prescene/interfaces/scene_files/robot_description.h"

namespace prescene::interfaces {

/// A <visual> or <collision>: a primitive or a mesh.
struct UrdfShape {
  FilePlace place;
  geometry::Pose X_LS;  ///< In the link's frame.
  std::optional<geometry::Primitive> primitive;
  std::string mesh;                                           ///< As written: package://..., file://..., or a path.
  geometry::Vector3d scale = geometry::Vector3d(1., 1., 1.);  ///< Of the mesh, metres per unit; none is 0.
};

struct UrdfLink {
  FilePlace place;
  std::string name;
  std::vector<UrdfShape> visuals, collisions;
  std::optional<belief::Color> color;  ///< Of the first visual that has one.
};

struct UrdfRobot {
  std::vector<UrdfLink> links;  ///< As they stand in the file.
  RobotKinematics kinematics;
};

/// Everything that is wrong goes to `problems`, with lines of `file`; nothing is returned then.
std::optional<UrdfRobot> parse_urdf(std::string_view text, const std::string& file, Problems& problems);

}  // namespace prescene::interfaces
