// SPDX-License-Identifier: Apache-2.0
// What takes seconds of a mesh of millions of triangles, so that it can be stopped: as the functions of triangle_mesh.h
// with the same names, but kCancelled soon after that was requested.
#pragma once

#include "prescene/core/progress.h"
#include "prescene/geometry/triangle_mesh.h"

namespace prescene::geometry {

/// `cancellation` may be null.
core::Result<TriangleMesh> repair_mesh(TriangleMesh mesh, MeshRepairReport* report,
                                       const core::Cancellation* cancellation);
core::Result<TriangleMesh> convex_hull(const std::vector<Vector3d>& points, const core::Cancellation* cancellation);

}  // namespace prescene::geometry
