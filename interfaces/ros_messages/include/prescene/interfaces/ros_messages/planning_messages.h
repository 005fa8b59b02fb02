// SPDX-License-Identifier: Apache-2.0
// The ROS 2 messages that tell MoveIt what is around the robot (moveit_msgs/CollisionObject and what it holds), as
// plain structs with the fields of their .msg files in wire order, as in messages.h.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "prescene/interfaces/ros_messages/messages.h"

namespace prescene::interfaces {

/// geometry_msgs/Point32.
struct RosPoint32 {
  float x = 0.0F;
  float y = 0.0F;
  float z = 0.0F;
  friend bool operator==(const RosPoint32&, const RosPoint32&) = default;
};

/// geometry_msgs/Polygon.
struct RosPolygon {
  std::vector<RosPoint32> points;
  friend bool operator==(const RosPolygon&, const RosPolygon&) = default;
};

/// shape_msgs/SolidPrimitive: what the type is.
enum class RosPrimitiveType : std::uint8_t { kBox = 1, kSphere = 2, kCylinder = 3, kCone = 4, kPrism = 5 };

/// shape_msgs/SolidPrimitive, about its middle. Lengths in m.
struct RosSolidPrimitive {
  std::uint8_t type = 0;  ///< A RosPrimitiveType, or nonsense.
  /// At most three: edges along x, y and z of a box, the radius of a sphere, height along z and radius of a cylinder or
  /// a cone, the height of a prism.
  std::vector<double> dimensions;
  RosPolygon polygon;  ///< The base of a prism.
  friend bool operator==(const RosSolidPrimitive&, const RosSolidPrimitive&) = default;
};

/// shape_msgs/MeshTriangle.
struct RosMeshTriangle {
  std::array<std::uint32_t, 3> vertex_indices{};
  friend bool operator==(const RosMeshTriangle&, const RosMeshTriangle&) = default;
};

/// shape_msgs/Mesh.
struct RosMesh {
  std::vector<RosMeshTriangle> triangles;
  std::vector<RosPoint> vertices;
  friend bool operator==(const RosMesh&, const RosMesh&) = default;
};

/// shape_msgs/Plane: a, b, c and d of ax + by + cz + d = 0.
struct RosPlane {
  std::array<double, 4> coef{};
  friend bool operator==(const RosPlane&, const RosPlane&) = default;
};

/// object_recognition_msgs/ObjectType.
struct RosObjectType {
  std::string key;
  std::string db;
  friend bool operator==(const RosObjectType&, const RosObjectType&) = default;
};

/// moveit_msgs/CollisionObject: what is to be done.
enum class RosCollisionOperation : std::uint8_t { kAdd = 0, kRemove = 1, kAppend = 2, kMove = 3 };

/// moveit_msgs/CollisionObject. The poses of shapes and subframes are in the frame of the object, which is `pose` in
/// the header's.
struct RosCollisionObject {
  RosHeader header;
  RosPose pose;
  std::string id;
  RosObjectType type;
  std::vector<RosSolidPrimitive> primitives;
  std::vector<RosPose> primitive_poses;
  std::vector<RosMesh> meshes;
  std::vector<RosPose> mesh_poses;
  std::vector<RosPlane> planes;
  std::vector<RosPose> plane_poses;
  std::vector<std::string> subframe_names;
  std::vector<RosPose> subframe_poses;
  std::uint8_t operation = 0;  ///< A RosCollisionOperation, or nonsense.
  friend bool operator==(const RosCollisionObject&, const RosCollisionObject&) = default;
};

}  // namespace prescene::interfaces
