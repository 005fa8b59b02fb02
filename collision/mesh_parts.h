// SPDX-License-Identifier: Apache-2.0
// The pieces that a mesh falls into.
#pragma once

#include <vector>

#include "prescene/collision/mesh.h"

namespace prescene::collision {

/// A corner of each piece, in the order of the pieces' first triangles. Triangles are of one piece where corners of
/// theirs are at the same place.
std::vector<Vector3f> corners_of_parts(const std::vector<Vector3f>& vertices,
                                       const std::vector<TriangleIndices>& triangles);

}  // namespace prescene::collision
