// SPDX-License-Identifier: Apache-2.0
#include "prescene/rendering/reference/reference_renderer.h"

#include <gtest/gtest.h>

namespace prescene::rendering {
namespace {

using geometry::Pose;

// A camera in which the point (i / 64, j / 64, 1) is exactly pixel (i, j).
const geometry::PinholeCamera kExactCamera = {24, 16, 64.0, 64.0, 0.0, 0.0};

geometry::TriangleMesh quad(double x0, double y0, double x1, double y1, bool other_diagonal) {
  geometry::TriangleMesh mesh;
  for (const auto& [x, y] : {std::pair{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}})
    mesh.vertices.push_back({x / 64.0, y / 64.0, 1.0});
  if (other_diagonal)
    mesh.triangles = {{0, 1, 3}, {1, 2, 3}};
  else
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

TEST(ReferenceRenderer, GivesAPixelOnAnEdgeToTheTriangleBelowOrToTheRight) {
  // Squares of 4 pixels with corners exactly on pixel centres, each with a label of its own, in a mixed order.
  RenderScene scene;
  std::vector<std::pair<int, int>> corner_of_label = {{-1, -1}};
  for (int k = 0; k < 24; ++k) {
    const int i = (7 * k) % 24;
    const int x = 4 * (i % 6);
    const int y = 4 * (i / 6);
    scene.instances.push_back({make_render_mesh(quad(x, y, x + 4, y + 4, k % 2 == 0)), Pose::identity(), {}});
    corner_of_label.push_back({x, y});
  }
  RenderedView view;
  ASSERT_TRUE(make_reference_renderer()->render(scene, kExactCamera, Pose::identity(), {}, &view).ok());
  for (int y = 0; y < 16; ++y) {
    for (int x = 0; x < 24; ++x) {
      const auto& corner = corner_of_label[view.labels(x, y)];
      EXPECT_EQ(corner, (std::pair{x / 4 * 4, y / 4 * 4})) << x << ", " << y;
      EXPECT_NEAR(view.depth(x, y), 1.0, 1e-6);
    }
  }
}

TEST(ReferenceRenderer, ExcludesTheLowerAndRightEdges) {
  RenderScene scene;
  scene.instances = {{make_render_mesh(quad(3, 2, 8, 6, false)), Pose::identity(), {}}};
  RenderedView view;
  ASSERT_TRUE(make_reference_renderer()->render(scene, kExactCamera, Pose::identity(), {}, &view).ok());
  for (int y = 0; y < 16; ++y)
    for (int x = 0; x < 24; ++x) EXPECT_EQ(view.labels(x, y), x >= 3 && x < 8 && y >= 2 && y < 6 ? 1 : 0);
}

TEST(ReferenceRenderer, InterpolatesOneOverDepth) {
  // A wall receding from 1 m to 3 m: along the image depth is not linear, one over it is.
  geometry::TriangleMesh wall;
  wall.vertices = {{-0.5, -1.0, 1.0}, {1.5, -1.0, 3.0}, {1.5, 1.0, 3.0}, {-0.5, 1.0, 1.0}};
  wall.triangles = {{0, 1, 2}, {0, 2, 3}};
  const geometry::PinholeCamera camera = {100, 10, 100.0, 100.0, 49.5, 4.5};
  RenderScene scene;
  scene.instances = {{make_render_mesh(wall), Pose::identity(), {}}};
  RenderedView view;
  RenderOptions options;
  options.normals = true;
  ASSERT_TRUE(make_reference_renderer()->render(scene, camera, Pose::identity(), options, &view).ok());
  for (int x = 0; x < 100; ++x) {
    // The wall is x = z - 1.5: u' z = z - 1.5.
    const double u = (x - 49.5) / 100.0;
    EXPECT_NEAR(view.depth(x, 5), 1.5 / (1.0 - u), 1e-6);
    EXPECT_TRUE(
        view.normals(x, 5).isApprox(Vector3f(1, 0, -1).normalized() * (view.normals(x, 5).z() < 0 ? 1 : -1), 1e-5f));
  }
}

}  // namespace
}  // namespace prescene::rendering
