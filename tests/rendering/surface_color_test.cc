// SPDX-License-Identifier: Apache-2.0
#include "prescene/rendering/surface_color.h"

#include <gtest/gtest.h>

#include <memory>

namespace prescene::rendering {
namespace {

TEST(SurfaceColor, SrgbGoesThereAndBack) {
  for (int value = 0; value < 256; ++value) {
    const auto channel = static_cast<std::uint8_t>(value);
    EXPECT_EQ(srgb(linear({channel, 0, 255})), (geometry::Rgb{channel, 0, 255}));
  }
  // The standard's own figures: the two branches meet, and middle grey.
  EXPECT_NEAR(linear_of_srgb(0.04045), 0.0031308, 1e-7);
  EXPECT_NEAR(linear_of_srgb(0.5), 0.21404, 1e-5);
  EXPECT_NEAR(srgb_of_linear(0.18), 0.46136, 1e-5);
  EXPECT_EQ(srgb({2.0, -1.0, 1.0}), (geometry::Rgb{255, 0, 255}));
}

TEST(SurfaceColor, TexturesAreBlendedBetweenCentresAndRepeated) {
  geometry::ColorImage texture(4, 1);
  texture(0, 0) = {0, 0, 0};
  texture(1, 0) = {255, 255, 255};
  texture(2, 0) = {255, 0, 0};
  texture(3, 0) = {0, 0, 255};
  for (const double turns : {-2.0, 0.0, 5.0}) {
    EXPECT_TRUE(texture_at(texture, {turns + 0.375, 0.7}).isApprox(LinearRgb(1.0, 1.0, 1.0), 1e-12));
    EXPECT_TRUE(texture_at(texture, {turns + 0.25, 0.1}).isApprox(LinearRgb(0.5, 0.5, 0.5), 1e-12));
    // The last blends with the first of the next one.
    EXPECT_TRUE(texture_at(texture, {turns + 1.0, 0.1}).isApprox(LinearRgb(0.0, 0.0, 0.5), 1e-12));
  }
}

TEST(SurfaceColor, IsTheTexturesElseTheVerticesElseTheMaterials) {
  geometry::TriangleMesh mesh;
  mesh.vertices = {{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {2.0, 0.0, 0.0}};
  mesh.triangles = {{0, 1, 3}, {0, 1, 2}};  // the first has no area and is left out
  const SurfaceMaterial material = SurfaceMaterial::opaque({255, 0, 0});
  const geometry::Vector3d p(0.25, 0.5, 0.0);
  EXPECT_EQ(own_color(*make_render_mesh(mesh), 0, p, material), LinearRgb(1.0, 0.0, 0.0));
  MeshLook look;
  look.vertex_colors = {{0, 0, 0}, {255, 0, 0}, {0, 255, 255}, {9, 9, 9}};
  EXPECT_TRUE(own_color(*make_render_mesh(mesh, look), 0, p, material).isApprox(LinearRgb(0.25, 0.5, 0.5), 1e-6));
  auto texture = std::make_shared<geometry::ColorImage>(1, 1, geometry::Rgb{0, 0, 255});
  look.texture = texture;
  look.texture_places.assign(2, {Eigen::Vector2f(0.0f, 0.0f), {1.0f, 0.0f}, {0.0f, 1.0f}});
  const MeshHandle printed = make_render_mesh(mesh, look);
  EXPECT_EQ(printed->look.texture_places.size(), 1u);
  EXPECT_TRUE(own_color(*printed, 0, p, material).isApprox(LinearRgb(0.0, 0.0, 1.0), 1e-12));
}

}  // namespace
}  // namespace prescene::rendering
