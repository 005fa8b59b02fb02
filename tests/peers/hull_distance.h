// SPDX-License-Identifier: Apache-2.0
// Distance of convex hulls by FCL, as an independent reference for contacts.
#pragma once

#include "prescene/geometry/pose.h"
#include "prescene/geometry/triangle_mesh.h"

namespace prescene::tests {

/// A closed convex mesh and where it is.
struct PlacedHull {
  const geometry::TriangleMesh* mesh = nullptr;
  geometry::Pose X_WM;
};

/// Smallest distance of the two, m; how deep they overlap, negated, if they do (libccd's expanding polytopes, 1e-6 m).
double hull_distance_by_fcl(const PlacedHull& a, const PlacedHull& b);

}  // namespace prescene::tests
