// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>

#include "prescene/geometry/primitives.h"
#include "prescene/rendering/reference/reference_renderer.h"
#include "prescene/rendering/sensor/likelihood_batch.h"
#include "prescene/rendering/sensor/pixel_classes.h"

namespace prescene::rendering {
namespace {

/// A box seen at 0.8 m, `above` (m) in front of a known plane; whether a frame's sampled returns say on average what is
/// expected.
void expect_the_mean_of_samples(const SurfaceMaterial& material, double above) {
  geometry::PinholeCamera camera{80, 60, 72.0, 72.0, 39.5, 29.5};
  const SensorModel model;
  const auto mesh = make_render_mesh(geometry::make_mesh(geometry::BoxShape{{0.2, 0.2, 0.1}}));
  RenderScene scene;
  scene.instances.push_back({mesh, geometry::Pose::from_translation({0.0, 0.0, 0.85}), material});
  RenderOptions with_normals;
  with_normals.normals = true;
  RenderedView view;
  ASSERT_TRUE(make_reference_renderer()->render(scene, camera, geometry::Pose::identity(), with_normals, &view).ok());

  const geometry::DepthImage background(camera.width, camera.height, static_cast<float>(0.8 + above));
  const geometry::DepthImage seen(camera.width, camera.height, 0.8F);
  FrameTermsInput input;
  input.camera = camera;
  input.depth = seen.view();
  input.background = background.view();
  FrameTerms terms;
  FrameTermsOptions independent;
  independent.tempering.weight.correlated_px2 = 0.0;
  ASSERT_TRUE(make_frame_terms(input, independent, model, &terms).ok());
  ASSERT_EQ(terms.step, 1);
  const ExpectedEvidence expected = expected_evidence(terms, material, view.depth, view.normals);

  core::RandomStream stream(7, core::Purpose::kTest);
  AbsentMixture absent;
  absent.missing = model.options().background_missing;
  absent.peak_depth = 0.8 + above;
  absent.peak_sigma = std::hypot(model.hit_sigma(absent.peak_depth, 1.0), model.options().support_sigma);
  absent.peak_weight = model.options().background_weight;
  double log_ratio = 0.0, visible_log_ratio = 0.0;
  double visible = 0.0;
  double per_pixel = 0.0, per_pixel_squares = 0.0;
  constexpr int kFrames = 100;
  for (int frame = 0; frame < kFrames; ++frame) {
    double frame_visible = 0.0, frame_log_ratio = 0.0;
    for (int y = 0; y < camera.height; ++y)
      for (int x = 0; x < camera.width; ++x) {
        if (view.depth(x, y) == 0.0F) continue;
        const bool outline = view.depth(x - 1, y) == 0.0F || view.depth(x + 1, y) == 0.0F ||
                             view.depth(x, y - 1) == 0.0F || view.depth(x, y + 1) == 0.0F;
        PixelGeometry pixel;
        pixel.depth = view.depth(x, y);
        pixel.cosine = std::abs(view.normals(x, y).cast<double>().dot(camera.unproject(x, y, 1.0).normalized()));
        if (outline) pixel.outline_px = 0.5;
        const PixelMixture mixture = model.mixture(material, pixel);
        const double z = model.sample(mixture, absent, stream);
        log_ratio += model.log_ratio(mixture, z, absent);
        if (!(z > 0.0 && z >= mixture.depth - static_cast<double>(kMatchSigmas) * mixture.sigma)) continue;
        frame_visible += 1.0;
        frame_log_ratio += model.log_ratio(mixture, z, absent);
      }
    visible += frame_visible;
    visible_log_ratio += frame_log_ratio;
    per_pixel += frame_log_ratio / frame_visible;
    per_pixel_squares += std::pow(frame_log_ratio / frame_visible, 2);
  }
  ASSERT_GT(visible, 1000.0);
  EXPECT_NEAR(expected.of_all, log_ratio / visible, 0.1 * std::abs(expected.of_all) + 0.1);  // few nodes
  EXPECT_NEAR(expected.of_visible, visible_log_ratio / visible, 0.1 * std::abs(expected.of_visible) + 0.1);
  const double mean = per_pixel / kFrames;
  const double deviation = std::sqrt((per_pixel_squares - kFrames * mean * mean) / (kFrames - 1));
  EXPECT_NEAR(expected.deviation, deviation, 0.35 * deviation);  // few nodes, 7 % of chance, and means that differ
}

TEST(ExpectedEvidence, IsTheMeanOverWhatTheCameraMayReturn) {
  expect_the_mean_of_samples(SurfaceMaterial::opaque(), 0.5);
  expect_the_mean_of_samples(SurfaceMaterial::opaque(), 0.12);
  expect_the_mean_of_samples(SurfaceMaterial::opaque(), 0.02);
  expect_the_mean_of_samples(SurfaceMaterial::transparent(), 0.5);
  expect_the_mean_of_samples(SurfaceMaterial::mirror(), 0.5);
}

TEST(ExpectedEvidence, IsLessOfWhatIsThinAndOfWhatIsSeenThrough) {
  geometry::PinholeCamera camera{80, 60, 72.0, 72.0, 39.5, 29.5};
  const auto mesh = make_render_mesh(geometry::make_mesh(geometry::BoxShape{{0.2, 0.2, 0.1}}));
  RenderScene scene;
  scene.instances.push_back({mesh, geometry::Pose::from_translation({0.0, 0.0, 0.85}), {}});
  RenderOptions with_normals;
  with_normals.normals = true;
  RenderedView view;
  ASSERT_TRUE(make_reference_renderer()->render(scene, camera, geometry::Pose::identity(), with_normals, &view).ok());
  const auto expected = [&](const SurfaceMaterial& material, double above) {
    const geometry::DepthImage background(camera.width, camera.height, static_cast<float>(0.8 + above));
    FrameTermsInput input;
    input.camera = camera;
    input.depth = background.view();
    input.background = background.view();
    FrameTerms terms;
    EXPECT_TRUE(make_frame_terms(input, {}, SensorModel(), &terms).ok());
    return expected_evidence(terms, material, view.depth, view.normals).of_visible;
  };
  const double opaque = expected(SurfaceMaterial::opaque(), 0.5);
  EXPECT_GT(opaque, 4.0);
  EXPECT_LT(expected(SurfaceMaterial::opaque(), 0.008), 0.5 * opaque);
  EXPECT_LT(expected(SurfaceMaterial::transparent(), 0.5), 0.7 * opaque);
  // Nothing of it can be seen behind a known surface.
  const geometry::DepthImage front(camera.width, camera.height, 0.5F);
  FrameTermsInput input;
  input.camera = camera;
  input.depth = front.view();
  FrameTerms terms, hidden;
  ASSERT_TRUE(make_frame_terms(input, {}, SensorModel(), &terms).ok());
  with_known_surfaces(terms, front, &hidden);
  EXPECT_EQ(expected_evidence(hidden, SurfaceMaterial::opaque(), view.depth, view.normals).of_all, 0.0);
  EXPECT_EQ(expected_evidence(hidden, SurfaceMaterial::opaque(), view.depth, view.normals).of_visible, 0.0);
}

}  // namespace
}  // namespace prescene::rendering
