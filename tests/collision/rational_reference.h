// SPDX-License-Identifier: Apache-2.0
// Answers in rational arithmetic, by methods that share nothing with those of the library.
#pragma once

#include <span>

#include "prescene/collision/exact_triangles.h"

namespace prescene::collision {

/// Whether the convex hulls of two sets of points have a point in common: whether the linear programme "a mixture of
/// the first equals a mixture of the second" has a solution, by the simplex method in rational numbers with Bland's
/// rule.
bool rational_hulls_meet(std::span<const Vector3f> a, std::span<const Vector3f> b);

/// Distance of two triangles, rounded to double at the end only: the least squares problems on all pairs of faces,
/// edges and corners, of which those count whose solution lies within.
double rational_distance(const Triangle& a, const Triangle& b);

/// Sign of the determinant of the rows b - a, c - a, d - a.
int rational_orientation(const Vector3f& a, const Vector3f& b, const Vector3f& c, const Vector3f& d);

}  // namespace prescene::collision
