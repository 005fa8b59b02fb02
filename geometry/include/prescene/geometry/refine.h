// SPDX-License-Identifier: Apache-2.0
// Cuts big triangles, for methods that look at the corners of a mesh only.
#pragma once

#include <cstddef>

#include "prescene/geometry/triangle_mesh.h"

namespace prescene::geometry {

/// The same surface with its edges longer than `longest` (m) halved, again and again, as long as there are at most
/// `max_triangles`. Triangles that shared an edge still do. Keeps vertices and triangles, no other attribute.
TriangleMesh refined(const TriangleMesh& mesh, double longest, std::size_t max_triangles);

}  // namespace prescene::geometry
