// SPDX-License-Identifier: Apache-2.0
#include "mesh_clusters.h"

#include <meshoptimizer.h>

#include <algorithm>
#include <utility>

namespace prescene::rendering {
namespace {

// How much clusters should look one way rather than be compact, in [0, 1].
constexpr float kConeWeight = 0.5f;

std::size_t filled(std::size_t count) {
  return (count + MeshClusters::kMultiple - 1) / MeshClusters::kMultiple * MeshClusters::kMultiple;
}

/// Triangles by their corners, whichever comes first: the library does not say which is which.
class TriangleFinder {
 public:
  explicit TriangleFinder(const std::vector<TriangleCorners>& triangles) {
    sorted_.reserve(triangles.size());
    for (std::size_t i = 0; i < triangles.size(); ++i) sorted_.emplace_back(turned(triangles[i]), i);
    std::sort(sorted_.begin(), sorted_.end());
    taken_.resize(triangles.size());
  }
  /// One with these corners that was not taken before.
  std::size_t take(const TriangleCorners& corners) {
    auto found = std::lower_bound(sorted_.begin(), sorted_.end(), std::pair(turned(corners), std::size_t{0}));
    while (taken_[static_cast<std::size_t>(found - sorted_.begin())]) ++found;
    taken_[static_cast<std::size_t>(found - sorted_.begin())] = true;
    return found->second;
  }

 private:
  /// The least corner first.
  static TriangleCorners turned(TriangleCorners corners) {
    std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
    return corners;
  }

  std::vector<std::pair<TriangleCorners, std::size_t>> sorted_;
  std::vector<bool> taken_;
};

}  // namespace

std::vector<TriangleCluster> cluster_triangles(const std::vector<Vector3f>& vertices,
                                               const std::vector<TriangleCorners>& triangles) {
  const std::size_t indices = 3 * triangles.size();
  const std::size_t most = meshopt_buildMeshletsBound(indices, MeshClusters::kSize, MeshClusters::kSize);
  std::vector<meshopt_Meshlet> meshlets(most);
  std::vector<unsigned> of_cluster(most * MeshClusters::kSize);
  std::vector<unsigned char> corners(most * MeshClusters::kSize * 3);
  const std::size_t count = meshopt_buildMeshlets(
      meshlets.data(), of_cluster.data(), corners.data(), triangles.front().data(), indices, vertices.front().data(),
      vertices.size(), sizeof(Vector3f), MeshClusters::kSize, MeshClusters::kSize, kConeWeight);
  TriangleFinder finder(triangles);
  std::vector<TriangleCluster> clusters(count);
  for (std::size_t i = 0; i < count; ++i) {
    TriangleCluster& cluster = clusters[i];
    const unsigned* vertex = of_cluster.data() + meshlets[i].vertex_offset;
    cluster.vertices.assign(vertex, vertex + meshlets[i].vertex_count);
    const auto place_of = [&](std::uint32_t index) {
      return static_cast<std::uint32_t>(std::find(cluster.vertices.begin(), cluster.vertices.end(), index) -
                                        cluster.vertices.begin());
    };
    for (std::size_t t = 0; t < meshlets[i].triangle_count; ++t) {
      const unsigned char* corner = corners.data() + meshlets[i].triangle_offset + 3 * t;
      const std::size_t found = finder.take({vertex[corner[0]], vertex[corner[1]], vertex[corner[2]]});
      cluster.triangles.push_back(found);
      const TriangleCorners& own = triangles[found];
      cluster.corners.push_back({place_of(own[0]), place_of(own[1]), place_of(own[2])});
    }
  }
  return clusters;
}

MeshClusters clusters_of(const RenderMesh& mesh, const std::vector<TriangleCluster>& clusters) {
  MeshClusters result;
  result.count = clusters.size();
  std::size_t first = 0;
  for (const TriangleCluster& cluster : clusters) {
    for (std::size_t k = 0; k < MeshClusters::kSize; ++k) {
      const Vector3f& p = mesh.vertices[cluster.vertices[std::min(k, cluster.vertices.size() - 1)]];
      result.x.push_back(p.x());
      result.y.push_back(p.y());
      result.z.push_back(p.z());
      const bool there = k < cluster.corners.size();
      const TriangleCorners corners = there ? cluster.corners[k] : TriangleCorners{0, 0, 0};
      result.a.push_back(static_cast<std::int32_t>(corners[0]));
      result.b.push_back(static_cast<std::int32_t>(corners[1]));
      result.c.push_back(static_cast<std::int32_t>(corners[2]));
      const Vector3f normal = there ? mesh.normals[first + k] : Vector3f(0.0f, 0.0f, 0.0f);
      result.normal_x.push_back(normal.x());
      result.normal_y.push_back(normal.y());
      result.normal_z.push_back(normal.z());
      result.offset.push_back(there ? mesh.offsets[first + k] : 0.0f);
    }
    result.triangles.push_back(static_cast<std::uint8_t>(cluster.corners.size()));
    first += cluster.corners.size();
  }
  for (std::size_t i = 0; i < filled(clusters.size()); ++i) {
    const TriangleCluster& cluster = clusters[std::min(i, clusters.size() - 1)];
    std::vector<unsigned> indices;
    for (const TriangleCorners& corners : cluster.corners)
      for (const std::uint32_t corner : corners) indices.push_back(cluster.vertices[corner]);
    const meshopt_Bounds bounds = meshopt_computeClusterBounds(
        indices.data(), indices.size(), mesh.vertices.front().data(), mesh.vertices.size(), sizeof(Vector3f));
    result.centre_x.push_back(bounds.center[0]);
    result.centre_y.push_back(bounds.center[1]);
    result.centre_z.push_back(bounds.center[2]);
    result.radius.push_back(bounds.radius);
    result.axis_x.push_back(bounds.cone_axis[0]);
    result.axis_y.push_back(bounds.cone_axis[1]);
    result.axis_z.push_back(bounds.cone_axis[2]);
    result.cutoff.push_back(bounds.cone_cutoff);
  }
  for (std::size_t i = 0; i < filled(mesh.vertices.size()); ++i) {
    const Vector3f& p = mesh.vertices[std::min(i, mesh.vertices.size() - 1)];
    result.vertex_x.push_back(p.x());
    result.vertex_y.push_back(p.y());
    result.vertex_z.push_back(p.z());
  }
  return result;
}

}  // namespace prescene::rendering
