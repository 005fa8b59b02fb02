// SPDX-License-Identifier: Apache-2.0
// How a rigid body can lie on a level plane.
#pragma once

#include <vector>

#include "prescene/geometry/triangle_mesh.h"

namespace prescene::geometry {

/// One way to lie: on a face of the convex hull that carries the centre of mass.
struct RestingPose {
  Quaterniond R_WB;     ///< Turns the body so that the face lies down (its outward normal along -z of W).
  double height = 0.0;  ///< Of the centre of mass above the plane, m.
  /// Least angle that the body must be tipped by to fall off the face, rad; small = it hardly stands.
  double tip_angle = 0.0;
  /// Share of uniformly random rotations that end here when the body is put down slowly: the face's solid angle from
  /// the centre of mass and that of the faces from which it rolls here [Goldberg et al. 1999, quasi-static].
  double probability = 0.0;
};

/// Likeliest first; probabilities sum to one. Hull faces within `flatness` (rad) of each other count as one. Fails with
/// kInvalidInput when the vertices lie in a plane or the centre of mass is outside of the hull.
core::Result<std::vector<RestingPose>> resting_poses(const TriangleMesh& mesh, const Vector3d& p_BoBcm,
                                                     double flatness = 0.02);
/// The same of a mesh's convex hull, where it is known already.
core::Result<std::vector<RestingPose>> resting_poses_of_hull(TriangleMesh hull, const Vector3d& p_BoBcm,
                                                             double flatness = 0.02);

/// Index of the direction of the body's axes that points most upwards (z of W): +x, -x, +y, -y, +z, -z.
int face_up(const Quaterniond& R_WB);

}  // namespace prescene::geometry
