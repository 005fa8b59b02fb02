// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/outcomes/face_trap.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "prescene/geometry/polygon.h"

namespace prescene::simulation {

double distance_inside(const LevelFace& face, const Eigen::Vector2d& point) {
  return geometry::distance_inside(face.polygon, point);
}

std::vector<ConvexPolytope> shape_hulls(const std::vector<belief::CollisionShape>& shapes) {
  std::vector<ConvexPolytope> hulls;
  for (const belief::CollisionShape& shape : shapes) {
    // Other uses of meshes may have dents that their hull covers.
    if (const auto* mesh = std::get_if<belief::MeshShape>(&shape))
      if (mesh->use != belief::MeshUse::kConvexHull) continue;
    if (auto hull = make_polytope(belief::collision_mesh({shape}).vertices)) hulls.push_back(*std::move(hull));
  }
  return hulls;
}

void append_level_faces(const std::vector<ConvexPolytope>& hulls, const Pose& X_WB, double tolerance,
                        std::vector<LevelFace>& faces) {
  for (const ConvexPolytope& hull : hulls) {
    for (const ConvexPolytope::Face& face : hull.faces) {
      if ((X_WB.rotation * face.normal).z() < std::cos(tolerance)) continue;
      LevelFace& level = faces.emplace_back();
      level.height = -std::numeric_limits<double>::infinity();
      for (const std::uint32_t v : face.loop) {
        const Vector3d p = X_WB * hull.vertices[v];
        level.polygon.push_back(p.head<2>());
        level.height = std::max(level.height, p.z());
      }
    }
  }
}

double least_depth(const ConvexPolytope& hull, const Vector3d& point) {
  double least = std::numeric_limits<double>::infinity();
  for (const ConvexPolytope::Face& face : hull.faces) least = std::min(least, face.offset - face.normal.dot(point));
  return least;
}

double least_upright_height(const ConvexPolytope& hull, const Vector3d& center_of_mass_O, const Vector3d& up_O,
                            double angle) {
  // Each vertex alone lifts the centre by what is left of its arm when tilted away from below by the whole angle.
  double height = 0.0;
  for (const Vector3d& v : hull.vertices) {
    const Vector3d arm = v - center_of_mass_O;
    const double off_axis = std::atan2(up_O.cross(arm).norm(), -up_O.dot(arm));
    height = std::max(height, arm.norm() * std::cos(std::min(off_axis + angle, std::numbers::pi)));
  }
  return height;
}

double Trap::tilt(double height) const {
  const double rise = std::max(lowest, height) - edge_radius;
  const double depth = lowest - edge_radius;
  return std::atan2(arm, depth) - std::acos(std::clamp(rise / std::hypot(depth, arm), -1.0, 1.0));
}

std::optional<Trap> trap_of(const ConvexPolytope& hull, const Pose& X_WO, const Vector3d& center_of_mass_O,
                            const TrapPlane& plane, double edge_radius) {
  const Vector3d down_O = X_WO.rotation.conjugate() * Vector3d(0.0, 0.0, -1.0);
  double reach = 0.0;
  for (const Vector3d& v : hull.vertices) reach = std::max(reach, down_O.dot(v - center_of_mass_O));
  if ((X_WO * center_of_mass_O).z() - reach < plane.height - plane.sunk) return std::nullopt;

  // The face through which the vertical below the centre of mass leaves the body.
  const ConvexPolytope::Face* below = nullptr;
  double depth = 0.0, steepest = 0.0;
  for (const ConvexPolytope::Face& face : hull.faces) {
    const double distance = face.offset - face.normal.dot(center_of_mass_O);
    if (distance <= 0.0) return std::nullopt;
    const double along = face.normal.dot(down_O) / distance;
    if (along <= steepest) continue;
    steepest = along;
    below = &face;
    depth = distance;
  }
  if (!below) return std::nullopt;

  double arm = plane.longest_arm;
  const Vector3d foot = center_of_mass_O + depth * below->normal;
  for (std::size_t i = 0; i < below->loop.size(); ++i) {
    const Vector3d& from = hull.vertices[below->loop[i]];
    const Vector3d side = hull.vertices[below->loop[(i + 1) % below->loop.size()]] - from;
    arm = std::min(arm, below->normal.dot(side.cross(foot - from)) / side.norm());
  }
  arm -= edge_radius;
  if (arm <= 0.0) return std::nullopt;
  Trap trap;
  trap.lowest = depth;
  trap.arm = arm;
  trap.barrier = std::hypot(depth - edge_radius, arm) + edge_radius;
  trap.edge_radius = edge_radius;
  trap.face_normal_O = below->normal;
  return trap;
}

}  // namespace prescene::simulation
