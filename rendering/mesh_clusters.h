// SPDX-License-Identifier: Apache-2.0
// Clusters of neighbouring triangles, as renderers in vector instructions want them.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "prescene/rendering/render_scene.h"

namespace prescene::rendering {

using TriangleCorners = std::array<std::uint32_t, 3>;

/// One cluster: at most MeshClusters::kSize triangles, and of vertices.
struct TriangleCluster {
  std::vector<std::uint32_t> vertices;   ///< Of the mesh.
  std::vector<std::size_t> triangles;    ///< Of those given.
  std::vector<TriangleCorners> corners;  ///< Of each triangle: places in `vertices`.
};

/// Parts all triangles into clusters that look much the same way.
std::vector<TriangleCluster> cluster_triangles(const std::vector<Vector3f>& vertices,
                                               const std::vector<TriangleCorners>& triangles);

/// The arrays of a mesh whose triangles (with normals and offsets) come in the order of the clusters. At least one.
MeshClusters clusters_of(const RenderMesh& mesh, const std::vector<TriangleCluster>& clusters);

}  // namespace prescene::rendering
