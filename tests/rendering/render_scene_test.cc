// SPDX-License-Identifier: Apache-2.0
#include "prescene/rendering/render_scene.h"

#include <gtest/gtest.h>

#include "prescene/rendering/sensor/sensor_model.h"
#include "scenes.h"

namespace prescene::rendering {
namespace {

TEST(RenderMesh, HoldsEveryVertexWithinItsSphereAndOutwardNormals) {
  for (const tests::NamedMesh& named : tests::twenty_meshes()) {
    const MeshHandle mesh = make_render_mesh(named.mesh);
    ASSERT_EQ(mesh->normals.size(), mesh->triangles.size());
    for (const Vector3f& vertex : mesh->vertices)
      EXPECT_LE((vertex - mesh->centre).norm(), mesh->radius * (1.0f + 1e-6f)) << named.name;
    for (std::size_t i = 0; i < mesh->triangles.size(); ++i) {
      const auto& [a, b, c] = mesh->triangles[i];
      const Vector3f cross = (mesh->vertices[b] - mesh->vertices[a]).cross(mesh->vertices[c] - mesh->vertices[a]);
      EXPECT_NEAR(mesh->normals[i].norm(), 1.0f, 1e-5f) << named.name;
      EXPECT_GT(cross.dot(mesh->normals[i]), 0.0f) << named.name;
    }
  }
}

TEST(RenderMesh, IsClosedWhenNobodyCanSeeItsInside) {
  for (const tests::NamedMesh& named : tests::twenty_meshes()) {
    const bool open = named.name == "wavy sheet" || named.name == "single triangle" || named.name == "triangle soup";
    EXPECT_EQ(make_render_mesh(named.mesh)->closed, !open) << named.name;
  }
  geometry::TriangleMesh inside_out = geometry::make_mesh(geometry::Sphere{0.1});
  for (auto& triangle : inside_out.triangles) std::swap(triangle[1], triangle[2]);
  EXPECT_FALSE(make_render_mesh(inside_out)->closed);
}

TEST(RenderMesh, LeavesOutTrianglesWithoutArea) {
  const geometry::TriangleMesh mesh{{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 1, 3}, {1, 1, 3}}};
  EXPECT_EQ(make_render_mesh(mesh)->triangles.size(), 1u);
  EXPECT_TRUE(make_render_mesh({})->triangles.empty());
}

TEST(SurfaceMaterial, HasSharesThatSumToOne) {
  for (const SurfaceMaterial& material :
       {SurfaceMaterial{}, SurfaceMaterial::opaque(), SurfaceMaterial::transparent(), SurfaceMaterial::mirror()}) {
    EXPECT_TRUE(validate(material).ok()) << validate(material).message();
  }
  SurfaceMaterial too_much;
  too_much.hit = 0.95;
  EXPECT_EQ(validate(too_much).code(), core::StatusCode::kInvalidInput);
  SurfaceMaterial never;
  never.missing = 1.0;
  EXPECT_EQ(validate(never).code(), core::StatusCode::kInvalidInput);
}

}  // namespace
}  // namespace prescene::rendering
