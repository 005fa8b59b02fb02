// SPDX-License-Identifier: Apache-2.0
#include "prescene/rendering/render_scene.h"

#include <algorithm>
#include <atomic>

#include "mesh_clusters.h"
#include "prescene/core/check.h"
#include "prescene/geometry/mass_properties.h"

namespace prescene::rendering {
namespace {

/// Normal to a triangle, as long as twice its area.
geometry::Vector3d cross_of(const geometry::TriangleMesh& mesh, const std::array<std::uint32_t, 3>& triangle) {
  const geometry::Vector3d& a = mesh.vertices[triangle[0]];
  return (mesh.vertices[triangle[1]] - a).cross(mesh.vertices[triangle[2]] - a);
}

}  // namespace

UniqueNumber::UniqueNumber() {
  static std::atomic<std::uint64_t> last{0};
  value_ = ++last;
}

UniqueNumber& UniqueNumber::operator=(const UniqueNumber&) {
  value_ = UniqueNumber().value_;
  return *this;
}

MeshHandle make_render_mesh(const geometry::TriangleMesh& mesh, const MeshLook& look) {
  PRESCENE_CHECK(look.vertex_colors.empty() || look.vertex_colors.size() == mesh.vertices.size());
  PRESCENE_CHECK(look.texture_places.empty() ||
                 (look.texture_places.size() == mesh.triangles.size() && look.texture && !look.texture->empty()));
  auto result = std::make_shared<RenderMesh>();
  result->look.vertex_colors = look.vertex_colors;
  if (!look.texture_places.empty()) result->look.texture = look.texture;
  result->vertices.reserve(mesh.vertices.size());
  for (const geometry::Vector3d& vertex : mesh.vertices) result->vertices.push_back(vertex.cast<float>());
  std::vector<TriangleCorners> triangles;
  std::vector<std::size_t> sources;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& triangle = mesh.triangles[i];
    for (const std::uint32_t index : triangle)
      PRESCENE_CHECK_MSG(index < mesh.vertices.size(), "a mesh must be repaired before it is rendered");
    if (!(cross_of(mesh, triangle).norm() > 0.0)) continue;
    triangles.push_back(triangle);
    sources.push_back(i);
  }
  if (triangles.empty()) return result;
  const std::vector<TriangleCluster> clusters = cluster_triangles(result->vertices, triangles);
  for (const TriangleCluster& cluster : clusters) {
    for (const std::size_t i : cluster.triangles) {
      const geometry::Vector3d cross = cross_of(mesh, triangles[i]);
      const double twice_area = cross.norm();
      result->triangles.push_back(triangles[i]);
      result->normals.push_back((cross / twice_area).cast<float>());
      result->offsets.push_back(static_cast<float>(cross.dot(mesh.vertices[triangles[i][0]]) / twice_area));
      if (!look.texture_places.empty()) result->look.texture_places.push_back(look.texture_places[sources[i]]);
    }
  }
  result->clusters = clusters_of(*result, clusters);

  const geometry::Box box = geometry::bounding_box(mesh);
  const geometry::Vector3d centre = box.center();
  result->centre = centre.cast<float>();
  // A little larger than needed, so that rounding to single precision leaves no vertex outside.
  result->radius = static_cast<float>(geometry::radius_about(mesh, centre) * (1.0 + 1e-6));
  const geometry::MeshTopology topology = geometry::mesh_topology(mesh);
  result->closed = topology.watertight() && topology.oriented() && geometry::signed_volume(mesh) > 0.0;
  return result;
}

SurfaceMaterial SurfaceMaterial::opaque(const geometry::Rgb& color) {
  SurfaceMaterial material;
  material.color = color;
  return material;
}

SurfaceMaterial SurfaceMaterial::transparent(const geometry::Rgb& color) {
  SurfaceMaterial material;
  material.hit = 0.25;
  material.occluder = 0.03;
  material.behind = 0.65;
  material.outlier = 0.07;
  material.missing = 0.30;
  material.color = color;
  return material;
}

SurfaceMaterial SurfaceMaterial::mirror(const geometry::Rgb& color) {
  SurfaceMaterial material;
  material.hit = 0.55;
  material.occluder = 0.06;
  material.behind = 0.0;
  material.outlier = 0.39;
  material.missing = 0.60;
  material.color = color;
  return material;
}

}  // namespace prescene::rendering
