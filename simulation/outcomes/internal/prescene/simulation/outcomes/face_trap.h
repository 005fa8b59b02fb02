// SPDX-License-Identifier: Apache-2.0
// Whether a body on a level face can still get to another of its faces, or over the face's edge, with the energy it
// has.
//
// The centre of mass of a convex body above a plane can change from one face to the next only over an edge, where it is
// as high as the centre is far from that edge. Where the face below ends nearer than the body's own edge, the body tips
// there: then the lower height counts.
#pragma once

#include <optional>
#include <vector>

#include "prescene/belief/object_model.h"
#include "prescene/simulation/convex_polytope.h"

namespace prescene::simulation {

using geometry::Pose;

/// A level convex face that something may stand on.
struct LevelFace {
  std::vector<Eigen::Vector2d> polygon;  ///< Counter-clockwise from above, W (m).
  double height = 0.0;                   ///< z in W, m.
};
/// Distance of a point to the nearest side, negative outside (m).
double distance_inside(const LevelFace& face, const Eigen::Vector2d& point);

/// The hulls of a body's shapes, each in the body's frame. Flat shapes are left out.
std::vector<ConvexPolytope> shape_hulls(const std::vector<belief::CollisionShape>& shapes);
/// The faces of hulls that lie level on top of them when they stand at a pose, tilted by `tolerance` (rad) at most.
void append_level_faces(const std::vector<ConvexPolytope>& hulls, const Pose& X_WB, double tolerance,
                        std::vector<LevelFace>& faces);

/// Distance from a point inside to the nearest face (m); negative outside.
double least_depth(const ConvexPolytope& hull, const Vector3d& point);
/// What the centre of mass is at least above a plane that the hull is above, while the axis `up_O` (unit) is within
/// `angle` (rad) of upright; m.
double least_upright_height(const ConvexPolytope& hull, const Vector3d& center_of_mass_O, const Vector3d& up_O,
                            double angle);

/// What a body that stays on its present lowest face can still do.
struct Trap {
  double barrier = 0.0;  ///< Height of the centre of mass above the plane, m, below which it can't leave the face.
  double lowest = 0.0;   ///< Least height of the centre of mass above the plane while it stays, m.
  double arm = 0.0;      ///< Horizontal way from the centre of mass to where it would tip, m.
  double edge_radius = 0.0;
  Vector3d face_normal_O = Vector3d::Zero();  ///< Of the face below.
  /// Largest angle (rad) between the face and the plane while the centre of mass is not higher than `height` (m).
  double tilt(double height) const;
};

/// The level plane that a body is above.
struct TrapPlane {
  double height = 0.0;       ///< z in W, m.
  double longest_arm = 0.0;  ///< How far from below the centre of mass it is sure to reach, m.
  double sunk = 2e-3;        ///< How deep what is above it may have sunk into it, m.
};

/// `hull` is that of the whole body in O, or lies inside of it; `edge_radius` rounds its edges (m). Nothing when the
/// body is not above the plane.
std::optional<Trap> trap_of(const ConvexPolytope& hull, const Pose& X_WO, const Vector3d& center_of_mass_O,
                            const TrapPlane& plane, double edge_radius);

}  // namespace prescene::simulation
