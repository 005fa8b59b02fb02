// SPDX-License-Identifier: Apache-2.0
// Where the surface of a mesh is open, and how it is closed.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "prescene/collision/mesh.h"
#include "prescene/core/status.h"

namespace prescene::collision {

/// Edges, with vertices at equal positions taken as one, that the triangles don't run equally often in both directions.
struct OpenEdges {
  struct Edge {
    std::uint32_t from = 0;  ///< A triangle is missing that runs from here...
    std::uint32_t to = 0;    ///< ...to here.
    friend bool operator==(const Edge&, const Edge&) = default;
  };
  std::vector<Edge> edges;  ///< Sorted; an edge that misses two triangles stands twice.
};
OpenEdges open_edges(const Mesh& mesh);
/// kInvalidInput, with the mesh's name, the number of open edges and a place on one, when there are any.
core::Status check_closed(const Mesh& mesh, const OpenEdges& open, std::string_view remedy);

/// A mesh with its holes covered: each closed loop of open edges by triangles from its middle.
struct ClosedMesh {
  std::vector<Vector3f> vertices;
  std::vector<TriangleIndices> triangles;
  int holes = 0;  ///< Loops that were covered.
};
ClosedMesh close_holes(const Mesh& mesh, const OpenEdges& open);

}  // namespace prescene::collision
