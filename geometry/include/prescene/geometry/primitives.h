// SPDX-License-Identifier: Apache-2.0
// Primitive shapes, each centred on its frame's origin, and their meshes.
#pragma once

#include <variant>

#include "prescene/geometry/triangle_mesh.h"

namespace prescene::geometry {

struct Sphere {
  double radius;
  friend bool operator==(const Sphere&, const Sphere&) = default;
};
/// Full edge lengths along x, y, z.
struct BoxShape {
  Vector3d size;
  friend bool operator==(const BoxShape&, const BoxShape&) = default;
};
/// Axis z, from -length/2 to length/2.
struct Cylinder {
  double radius;
  double length;
  friend bool operator==(const Cylinder&, const Cylinder&) = default;
};
/// Axis z; length is that of the cylindrical part.
struct Capsule {
  double radius;
  double length;
  friend bool operator==(const Capsule&, const Capsule&) = default;
};
/// Axis z, base of the given radius at -length/2, tip at +length/2.
struct Cone {
  double radius;
  double length;
  friend bool operator==(const Cone&, const Cone&) = default;
};
using Primitive = std::variant<Sphere, BoxShape, Cylinder, Capsule, Cone>;

/// A closed, outward oriented mesh; curved faces get `segments` (>= 8) around the axis.
TriangleMesh make_mesh(const Primitive& primitive, int segments = 32);

/// An open-topped box: inner size (x, y, z of the hollow), wall thickness, floor included; closed surface with real
/// walls; the origin is the centre of the outer bottom face, z up.
TriangleMesh make_open_bin(const Vector3d& inner_size, double wall);
/// A milk carton: a box of the given base (x, y) and shoulder height with a gable roof and a fin, origin at the centre
/// of its bounding box, z up. total_height > shoulder_height.
TriangleMesh make_gable_carton(double size_x, double size_y, double shoulder_height, double total_height);
/// A surface of revolution about z of a profile of (radius, z) points from bottom to top, closed on the axis.
TriangleMesh make_lathe(const std::vector<Eigen::Vector2d>& profile, int segments = 32);

}  // namespace prescene::geometry
