// SPDX-License-Identifier: Apache-2.0
// Symmetry groups of objects: the rotations about the body's own frame under which it looks and behaves the same.
#pragma once

#include <optional>
#include <vector>

#include "prescene/geometry/pose.h"
#include "prescene/geometry/pose_error.h"
#include "prescene/geometry/triangle_mesh.h"

namespace prescene::geometry {

/// A group of rotations about the point p_BoC of the body: a finite list, and/or a continuous axis, or all of them.
/// No symmetry: `rotations` empty, no axis, no ball.
struct SymmetryGroup {
  std::vector<Quaterniond> rotations;  ///< Besides the identity; closed under products together with it and the axis.
  std::optional<Vector3d> axis;        ///< Unit vector in B: every turn about it is a symmetry.
  bool ball = false;                   ///< Every rotation is a symmetry; the two above do not matter then.
  Vector3d p_BoC = Vector3d::Zero();   ///< The point that all symmetries keep.

  static SymmetryGroup none() { return {}; }
  /// n turns of 360/n degrees about an axis through p_BoC.
  static SymmetryGroup cyclic(const Vector3d& axis, int n, const Vector3d& p_BoC = Vector3d::Zero());
  /// Continuous about an axis; with `flip`, also the half turns that exchange its ends.
  static SymmetryGroup continuous(const Vector3d& axis, bool flip, const Vector3d& p_BoC = Vector3d::Zero());
  /// The four rotations of a cuboid of three different edges.
  static SymmetryGroup cuboid(const Vector3d& p_BoC = Vector3d::Zero());
  /// The 24 rotations of a cube whose faces are across the axes of the body's frame.
  static SymmetryGroup cube(const Vector3d& p_BoC = Vector3d::Zero());
  /// Every rotation about p_BoC.
  static SymmetryGroup every_rotation(const Vector3d& p_BoC = Vector3d::Zero());

  bool trivial() const { return rotations.empty() && !axis && !ball; }
  friend bool operator==(const SymmetryGroup& a, const SymmetryGroup& b);
};

/// The symmetric equivalent of X_WB closest in rotation to X_WR: X_WB * S for the best S of the group.
Pose closest_equivalent(const Pose& X_WB, const Pose& X_WR, const SymmetryGroup& group);
/// Rotation angle between two poses modulo the group, radians.
double symmetric_angle(const Pose& X_a, const Pose& X_b, const SymmetryGroup& group);

/// Candidate symmetries of a mesh that keep sampled surface points within `tolerance` (m) of the surface. Tried are the
/// axes of the mesh's frame, the principal axes and, for bodies whose moments are (almost) equal, the diagonals of the
/// frame, through the centre of mass, with 2 to 8 steps and continuous. Empty meshes have none.
SymmetryGroup suggest_symmetry(const TriangleMesh& mesh, double tolerance);

}  // namespace prescene::geometry
