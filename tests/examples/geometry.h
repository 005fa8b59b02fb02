// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of geometry take for granted.
#pragma once

#include "prescene/geometry/triangle_mesh.h"

namespace prescene::geometry::given_geometry {

extern const TriangleMesh mesh, coarse;

}  // namespace prescene::geometry::given_geometry
