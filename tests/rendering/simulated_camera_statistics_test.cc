// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <vector>

#include "prescene/rendering/reference/reference_renderer.h"
#include "prescene/rendering/sensor/simulated_camera.h"
#include "scenes.h"

namespace prescene::rendering {
namespace {

using core::Purpose;
using core::RandomStream;
using geometry::Pose;
using geometry::Vector3d;

/// A square card, tilted, before a wall.
class SimulatedCameraTest : public testing::Test {
 protected:
  static RenderInstance card(double size, const Vector3d& p, double tilt, const SurfaceMaterial& material = {}) {
    geometry::TriangleMesh mesh;
    const double h = 0.5 * size;
    mesh.vertices = {{-h, -h, 0}, {h, -h, 0}, {h, h, 0}, {-h, h, 0}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    return {make_render_mesh(mesh), {geometry::exp_rotation({0, tilt, 0}), p}, material};
  }

  RenderedView render(const RenderScene& scene) {
    RenderedView view;
    RenderOptions options;
    options.normals = true;
    EXPECT_TRUE(renderer_->render(scene, camera_, Pose::identity(), options, &view).ok());
    return view;
  }

  geometry::DepthImage sample(const RenderScene& scene, const RenderedView& view, std::uint64_t frame,
                              const SimulatedCameraOptions& options = {}, const RenderedView* behind = nullptr) {
    geometry::DepthImage depth;
    SimulatedCamera(SensorModel{}, options)
        .sample(scene, view, behind, camera_, Pose::identity(), RandomStream(31, Purpose::kSensorNoise), frame, &depth,
                nullptr);
    return depth;
  }

  std::unique_ptr<Renderer> renderer_ = make_reference_renderer();
  geometry::PinholeCamera camera_ = tests::camera_of_width(320);
};

TEST_F(SimulatedCameraTest, NoiseGrowsAsTheModelSays) {
  for (const auto& [depth, tilt] : {std::pair{0.6, 0.0}, {1.2, 0.0}, {2.0, 0.0}, {0.9, 1.1}}) {
    RenderScene scene;
    scene.instances = {card(30.0, {0, 0, depth}, tilt)};
    const RenderedView view = render(scene);
    double squares = 0.0;
    int count = 0;
    for (std::uint64_t frame = 0; frame < 6; ++frame) {
      const geometry::DepthImage returned = sample(scene, view, frame);
      for (int y = 0; y < camera_.height; ++y) {
        for (int x = 0; x < camera_.width; ++x) {
          const Vector3d ray = camera_.unproject(x, y, 1.0).normalized();
          const double cosine = std::abs(ray.dot(view.normals(x, y).cast<double>()));
          const double sigma = SensorModel{}.hit_sigma(view.depth(x, y), cosine);
          const double z = returned(x, y);
          const double t = (z - view.depth(x, y)) / sigma;
          if (z == 0.0 || view.depth(x, y) == 0.0f || std::abs(t) > 5.0) continue;
          squares += t * t;
          ++count;
        }
      }
    }
    ASSERT_GT(count, 100000);
    // Neighbours share their noise: six frames of about 500 patches of their own, half of it in the fixed pattern's
    // case even the same in each. Four standard errors of the variance are about 0.25.
    EXPECT_NEAR(squares / count, 1.0, 0.25) << depth << " m, tilted " << tilt;
  }
}

TEST_F(SimulatedCameraTest, SharesOfMissingReturnsAreTheMeasuredOnes) {
  RenderScene scene;
  scene.instances = {card(0.5, {0, 0, 0.9}, 0.0), card(30.0, {0, 0, 1.6}, 0.0)};
  const RenderedView view = render(scene);
  std::vector<double> missing(5, 0.0);
  std::vector<double> total(5, 0.0);
  for (std::uint64_t frame = 0; frame < 60; ++frame) {
    const geometry::DepthImage returned = sample(scene, view, frame);
    const double half_width = 0.25 / 0.9 * camera_.fx;
    const double half_height = 0.25 / 0.9 * camera_.fy;
    for (int y = 0; y < camera_.height; ++y) {
      for (int x = 0; x < camera_.width; ++x) {
        if (view.labels(x, y) != 1) continue;
        // Distance to the border between pixels, by hand: the card is a rectangle.
        const double px = std::min(half_width - std::abs(x - camera_.cx), half_height - std::abs(y - camera_.cy)) + 0.5;
        const std::size_t c = px <= 1.5 ? 0 : px <= 3 ? 1 : px <= 6 ? 2 : px <= 12 ? 3 : 4;
        total[c] += 1.0;
        if (returned(x, y) == 0.0f) missing[c] += 1.0;
      }
    }
  }
  const double expected[] = {0.38, 0.35, 0.27, 0.12, 0.03};
  // A border of 4 x 100 pixels in patches of twelve: some 30 independent ones a frame, 60 frames: 0.011 standard error;
  // the classes' limits by the card's true border move them by less than half a pixel.
  for (std::size_t c = 0; c < 5; ++c) EXPECT_NEAR(missing[c] / total[c], expected[c], 0.05) << c;

  scene.instances = {card(30.0, {0, 0, 1.0}, 1.25)};
  const RenderedView tilted = render(scene);
  double steep_missing = 0.0;
  double steep = 0.0;
  for (std::uint64_t frame = 0; frame < 30; ++frame) {
    const geometry::DepthImage returned = sample(scene, tilted, frame);
    for (int y = 0; y < camera_.height; ++y) {
      for (int x = 0; x < camera_.width; ++x) {
        const Vector3d ray = camera_.unproject(x, y, 1.0).normalized();
        const double cosine = std::abs(ray.dot(tilted.normals(x, y).cast<double>()));
        if (tilted.labels(x, y) == 0 || cosine < 0.2 || cosine > 0.4 || tilted.depth(x, y) > 2.3f) continue;
        steep += 1.0;
        if (returned(x, y) == 0.0f) steep_missing += 1.0;
      }
    }
  }
  ASSERT_GT(steep, 50000);
  EXPECT_NEAR(steep_missing / steep, 0.28, 0.04);
}

TEST_F(SimulatedCameraTest, NeighboursShareTheirNoise) {
  RenderScene scene;
  scene.instances = {card(30.0, {0, 0, 1.0}, 0.0)};
  const RenderedView view = render(scene);
  SimulatedCameraOptions options;
  options.missing = false;
  options.interior_outlier = 0.0;
  std::vector<double> products(3, 0.0);
  double squares = 0.0;
  int count = 0;
  for (std::uint64_t frame = 0; frame < 20; ++frame) {
    const geometry::DepthImage returned = sample(scene, view, frame, options);
    for (int y = 0; y < camera_.height; ++y) {
      for (int x = 0; x + 48 < camera_.width; ++x) {
        const auto error = [&](int dx) { return static_cast<double>(returned(x + dx, y)) - 1.0; };
        squares += error(0) * error(0);
        ++count;
        products[0] += error(0) * error(1);
        products[1] += error(0) * error(8);
        products[2] += error(0) * error(48);
      }
    }
  }
  EXPECT_GT(products[0] / squares, 0.65);
  EXPECT_GT(products[1] / squares, 0.25);
  EXPECT_LT(products[1] / squares, products[0] / squares - 0.1);
  EXPECT_LT(std::abs(products[2] / squares), 0.1);
}

TEST_F(SimulatedCameraTest, DepthComesInSteps) {
  RenderScene scene;
  scene.instances = {card(30.0, {0, 0, 1.5}, 0.3)};
  const geometry::DepthImage returned = sample(scene, render(scene), 0);
  std::set<float> levels;
  for (std::size_t i = 0; i < returned.size(); ++i)
    if (returned.data()[i] > 0.0f) levels.insert(returned.data()[i]);
  ASSERT_GT(levels.size(), 20u);
  for (const float z : levels) {
    const double steps = 1.0 / (0.0013 * static_cast<double>(z));
    EXPECT_NEAR(steps, std::round(steps), 1e-3);
  }
}

TEST_F(SimulatedCameraTest, PixelsFlyBetweenTheTwoSidesOfAnEdge) {
  RenderScene scene;
  scene.instances = {card(0.4, {0, 0, 0.8}, 0.0), card(30.0, {0, 0, 1.2}, 0.0)};
  const RenderedView view = render(scene);
  SimulatedCameraOptions options;
  options.interior_outlier = 0.0;
  int between = 0;
  int beyond = 0;
  for (std::uint64_t frame = 0; frame < 5; ++frame) {
    const geometry::DepthImage returned = sample(scene, view, frame, options);
    for (std::size_t i = 0; i < returned.size(); ++i) {
      const float z = returned.data()[i];
      if (z == 0.0f) continue;
      if (z > 0.83f && z < 1.16f) ++between;
      if (z < 0.77f || z > 1.24f) ++beyond;
    }
  }
  EXPECT_GT(between, 100);
  EXPECT_EQ(beyond, 0);
}

TEST_F(SimulatedCameraTest, RepeatsAFrameAndVariesBetweenFrames) {
  RenderScene scene;
  scene.instances = {card(0.6, {0, 0, 0.9}, 0.4)};
  const RenderedView view = render(scene);
  EXPECT_TRUE(sample(scene, view, 4) == sample(scene, view, 4));
  EXPECT_FALSE(sample(scene, view, 4) == sample(scene, view, 5));
  // The pattern that stays is seen when nothing else is left.
  SimulatedCameraOptions fixed;
  fixed.fixed_pattern_share = 1.0;
  fixed.correlated_share = 0.0;
  fixed.missing = false;
  fixed.interior_outlier = 0.0;
  fixed.edge_outlier = {};
  const geometry::DepthImage a = sample(scene, view, 1, fixed);
  const geometry::DepthImage b = sample(scene, view, 2, fixed);
  EXPECT_EQ(a(160, 120), b(160, 120));
  EXPECT_NE(a(160, 120), view.depth(160, 120));
}

TEST_F(SimulatedCameraTest, SeesThroughGlass) {
  RenderScene scene;
  scene.instances = {card(0.5, {0, 0, 0.8}, 0.0, SurfaceMaterial::transparent()), card(30.0, {0, 0, 1.2}, 0.0)};
  RenderScene without = scene;
  without.instances[0].mesh = make_render_mesh({});
  const RenderedView view = render(scene);
  const RenderedView behind = render(without);
  double hits = 0.0, through = 0.0, missing = 0.0, total = 0.0;
  for (std::uint64_t frame = 0; frame < 40; ++frame) {
    const geometry::DepthImage returned = sample(scene, view, frame, {}, &behind);
    for (int y = 90; y < 150; ++y) {
      for (int x = 120; x < 200; ++x) {
        const float z = returned(x, y);
        total += 1.0;
        hits += std::abs(z - 0.8f) < 0.02f ? 1.0 : 0.0;
        through += std::abs(z - 1.2f) < 0.04f ? 1.0 : 0.0;
        missing += z == 0.0f ? 1.0 : 0.0;
      }
    }
  }
  // Patches of 12 pixels: 33 a frame, so 1300 in all; four standard errors are 0.05.
  EXPECT_NEAR(missing / total, 0.30, 0.06);
  EXPECT_NEAR(through / total, 0.70 * 0.93 * 0.65 / 0.93, 0.07);
  EXPECT_NEAR(hits / total, 0.70 * 0.93 * 0.28 / 0.93, 0.06);
}

TEST_F(SimulatedCameraTest, ShadesByMaterialAndLight) {
  RenderScene scene;
  scene.instances = {card(0.4, {-0.2, 0, 0.9}, 0.5, SurfaceMaterial::opaque({220, 20, 20})),
                     card(0.4, {0.2, 0, 0.9}, -0.5, SurfaceMaterial::opaque({20, 20, 220}))};
  const RenderedView view = render(scene);
  geometry::ColorImage color;
  shade(scene, view, Pose::identity(), {}, &color);
  int red = 0, blue = 0, background = 0;
  for (int y = 0; y < camera_.height; ++y) {
    for (int x = 0; x < camera_.width; ++x) {
      const geometry::Rgb& c = color(x, y);
      if (view.labels(x, y) == 1) red += c[0] > 3 * c[2] ? 1 : -1000000;
      if (view.labels(x, y) == 2) blue += c[2] > 3 * c[0] ? 1 : -1000000;
      if (view.labels(x, y) == 0) background += std::abs(c[0] - c[2]) < 40 ? 1 : -1000000;
    }
  }
  EXPECT_GT(red, 1000);
  EXPECT_GT(blue, 1000);
  EXPECT_GT(background, 1000);
}

TEST_F(SimulatedCameraTest, ShowsTheColoursOfMeshesWhereTheViewHasThem) {
  RenderScene scene;
  scene.instances = {card(0.4, {0, 0, 0.9}, 0.0, SurfaceMaterial::opaque({20, 20, 220}))};
  EXPECT_FALSE(has_looks(scene));
  auto red = std::make_shared<RenderMesh>(*scene.instances[0].mesh);
  red->look.vertex_colors.assign(red->vertices.size(), {220, 20, 20});
  scene.instances[0].mesh = red;
  EXPECT_TRUE(has_looks(scene));
  RenderedView view;
  RenderOptions options;
  options.normals = options.color = true;
  ASSERT_TRUE(renderer_->render(scene, camera_, Pose::identity(), options, &view).ok());
  geometry::ColorImage color;
  shade(scene, view, Pose::identity(), {}, &color);
  const int x = camera_.width / 2, y = camera_.height / 2;
  EXPECT_EQ(color(x, y), view.color(x, y));
  EXPECT_GT(color(x, y)[0], 3 * color(x, y)[2]);
  EXPECT_NE(color(0, 0), view.color(0, 0));  // the background is the camera's own
}

TEST_F(SimulatedCameraTest, ColourNoiseHasItsSize) {
  RenderScene scene;
  scene.instances = {card(30.0, {0, 0, 1.0}, 0.0)};
  const RenderedView view = render(scene);
  geometry::ColorImage clean;
  shade(scene, view, Pose::identity(), {}, &clean);
  geometry::DepthImage depth;
  geometry::ColorImage noisy;
  SimulatedCamera(SensorModel{}, {})
      .sample(scene, view, nullptr, camera_, Pose::identity(), RandomStream(32, Purpose::kSensorNoise), 0, &depth,
              &noisy);
  double squares = 0.0;
  for (std::size_t i = 0; i < clean.size(); ++i) {
    const double difference = static_cast<double>(noisy.data()[i][1]) - clean.data()[i][1];
    squares += difference * difference;
  }
  EXPECT_NEAR(std::sqrt(squares / static_cast<double>(clean.size())), 2.0, 0.05);
}

}  // namespace
}  // namespace prescene::rendering
