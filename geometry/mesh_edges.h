// SPDX-License-Identifier: Apache-2.0
// Edges of a mesh as a sorted list: the walk that topology, repair and simplification share.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "prescene/geometry/triangle_mesh.h"

namespace prescene::geometry {

using Triangle = std::array<std::uint32_t, 3>;

/// One triangle's run along an edge; from corner `corner` of the triangle to the next.
struct EdgeUse {
  std::uint32_t low;  ///< The edge's vertices, low < high.
  std::uint32_t high;
  std::uint32_t triangle;
  std::uint8_t corner;
  bool forward;  ///< From low to high.
};

/// All uses, sorted by (low, high, triangle); triangles with two equal corners are left out.
std::vector<EdgeUse> edge_uses(const std::vector<Triangle>& triangles);

/// Calls visit(span of the uses of one edge) for each edge in order.
template <class Visit>
void for_each_edge(const std::vector<EdgeUse>& uses, const Visit& visit) {
  for (std::size_t begin = 0, end = 0; begin < uses.size(); begin = end) {
    while (end < uses.size() && uses[end].low == uses[begin].low && uses[end].high == uses[begin].high) ++end;
    visit(std::span<const EdgeUse>(uses).subspan(begin, end - begin));
  }
}

/// For each vertex the lowest index of a vertex at a bit-equal position (0 and -0 are equal).
std::vector<std::uint32_t> welded_indices(const std::vector<Vector3d>& vertices);

/// The mesh with only the vertices that its triangles use, in their order.
TriangleMesh with_used_vertices(const std::vector<Vector3d>& vertices, std::vector<Triangle> triangles);

}  // namespace prescene::geometry
