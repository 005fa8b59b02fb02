// SPDX-License-Identifier: Apache-2.0
// Whether two triangles, or a segment and a triangle, have a point in common, decided exactly. All are closed sets:
// touching counts. Triangles without area are the segments or points that their corners span. Coordinates as in
// orientation.h.
//
// The last word for everything that the kernels of triangle_pairs-inl.h are not sure of.
#pragma once

#include <array>

#include "prescene/collision/mesh.h"

namespace prescene::collision {

using Triangle = std::array<Vector3f, 3>;

/// Whether the corners lie in a line.
bool is_degenerate(const Triangle& triangle);

/// By the signs of the corners against the other's plane, and of the edges that cross it against the other's edges;
/// which of them decide is explained by [Guigue and Devillers 2003].
bool triangles_intersect(const Triangle& a, const Triangle& b);

/// The segment from p to q; p = q is a point.
bool segment_meets_triangle(const Vector3f& p, const Vector3f& q, const Triangle& triangle);

}  // namespace prescene::collision
