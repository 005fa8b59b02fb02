// SPDX-License-Identifier: Apache-2.0
// On which side of a plane or a line a point lies, decided exactly for single-precision coordinates: what every exact
// answer of this library rests on. A double-precision value decides when it is further from zero than its rounding can
// be; otherwise an expansion, a sum of doubles without any rounding, does [Shewchuk 1997].
//
// Coordinates are finite and at most kLargestCoordinate in size; everything else down to the smallest denormal number
// is legal, as the products that occur stay far inside the range of double precision. The rounding mode is to nearest
// and denormal numbers are not flushed (the default of every thread).
#pragma once

#include "prescene/collision/mesh.h"

namespace prescene::collision {

/// Sign of ((b - a) x (c - a)) . (d - a): +1 when d is on the side of the plane abc to which its normal points, -1 on
/// the other side, 0 when the four points lie in one plane.
int orientation(const Vector3f& a, const Vector3f& b, const Vector3f& c, const Vector3f& d);

/// Sign of the area of abc as seen along an axis (0 x, 1 y, 2 z) from its positive end: +1 anticlockwise, 0 in a line.
int orientation_along(int axis, const Vector3f& a, const Vector3f& b, const Vector3f& c);

}  // namespace prescene::collision
