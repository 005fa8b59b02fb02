// SPDX-License-Identifier: Apache-2.0
// The last word on a pair of meshes: every pair of triangles whose boxes meet, without any tree.
#pragma once

#include "prescene/collision/mesh.h"
#include "prescene/collision/transform.h"

namespace prescene::tests {

/// Whether a triangle of A and a triangle of B, with B's vertices put into A's frame as transform.h says, have a point
/// in common: decided exactly for the single-precision triangles.
bool collide_by_brute_force(const collision::Mesh& a, const collision::Mesh& b, const collision::Transform& X_AB);

/// Smallest distance of the same triangles, m, in double precision, or `limit` where they are further apart: 0 when
/// they collide. The time grows with `limit`.
double distance_by_brute_force(const collision::Mesh& a, const collision::Mesh& b, const collision::Transform& X_AB,
                               double limit);

}  // namespace prescene::tests
