// SPDX-License-Identifier: Apache-2.0
#include "prescene/rendering/sensor/frame_pyramid.h"

#include <gtest/gtest.h>

#include <cmath>

#include "prescene/geometry/sampling.h"
#include "prescene/rendering/reference/reference_renderer.h"
#include "scenes.h"

namespace prescene::rendering {
namespace {

using geometry::Pose;
using geometry::Vector3d;

class FramePyramidTest : public testing::Test {
 protected:
  FramePyramidTest() : depth_(640, 480) {
    core::RandomStream stream(3, core::Purpose::kTest);
    for (std::size_t i = 0; i < depth_.size(); ++i)
      depth_.data()[i] = stream.uniform() < 0.1 ? 0.0f : static_cast<float>(stream.uniform(0.5, 2.0));
    input_.camera = tests::camera_of_width(640);
    input_.depth = depth_.view();
  }

  geometry::DepthImage depth_;
  FrameTermsInput input_;
};

TEST_F(FramePyramidTest, EachLevelIsTheFramesTermsOfItsWidth) {
  FramePyramid pyramid;
  ASSERT_TRUE(pyramid.reset(input_, {}, SensorModel{}).ok());
  ASSERT_EQ(pyramid.levels(), 4);
  const int widths[] = {80, 160, 320, 640};
  // Twice, the second time with another frame in the same memory.
  for (int round = 0; round < 2; ++round) {
    for (const int i : {3, 1, 0, 2, 1}) {
      FrameTermsOptions options;
      options.target_width = widths[i];
      FrameTerms expected;
      ASSERT_TRUE(make_frame_terms(input_, options, SensorModel{}, &expected).ok());
      const FrameTerms& level = pyramid.level(i);
      EXPECT_EQ(level.step, 8 >> i);
      EXPECT_EQ(level.camera, expected.camera);
      EXPECT_EQ(level.depth, expected.depth);
      EXPECT_EQ(level.inverse_absent, expected.inverse_absent);
    }
    depth_(100, 100) += 0.125f;
    ASSERT_TRUE(pyramid.reset(input_, {}, SensorModel{}).ok());
  }
}

TEST_F(FramePyramidTest, HasNoLevelFinerThanAskedForOrThanTheFrame) {
  FramePyramid pyramid;
  FramePyramidOptions options;
  options.finest_width = 200;
  ASSERT_TRUE(pyramid.reset(input_, options, SensorModel{}).ok());
  EXPECT_EQ(pyramid.levels(), 2);
  options.finest_width = 40;
  ASSERT_TRUE(pyramid.reset(input_, options, SensorModel{}).ok());
  EXPECT_EQ(pyramid.levels(), 1);
  geometry::DepthImage small(100, 75, 1.0f);
  input_.camera = tests::camera_of_width(100);
  input_.depth = small.view();
  ASSERT_TRUE(pyramid.reset(input_, {}, SensorModel{}).ok());
  EXPECT_EQ(pyramid.levels(), 1);
  EXPECT_EQ(pyramid.level(0).step, 1);
}

TEST_F(FramePyramidTest, CoveredPixelsAreThoseThatARendererCovers) {
  const geometry::PinholeCamera camera = tests::camera_of_width(640);
  core::RandomStream stream(5, core::Purpose::kTest);
  const auto renderer = make_reference_renderer();
  const geometry::TriangleMesh shapes[] = {geometry::make_mesh(geometry::Sphere{0.08}, 40),
                                           geometry::make_mesh(geometry::BoxShape{{0.2, 0.1, 0.05}}),
                                           geometry::make_mesh(geometry::Cylinder{0.05, 0.2}, 40)};
  for (const geometry::TriangleMesh& shape : shapes) {
    const MeshHandle mesh = make_render_mesh(shape);
    for (int i = 0; i < 10; ++i) {
      const Pose X_CO{geometry::uniform_rotation(stream), {0.05, -0.03, stream.uniform(0.6, 1.5)}};
      RenderScene scene;
      scene.instances.push_back({mesh, X_CO, {}});
      RenderedView view;
      ASSERT_TRUE(renderer->render(scene, camera, Pose::identity(), {}, &view).ok());
      int covered = 0;
      for (std::size_t k = 0; k < view.depth.size(); ++k) covered += view.depth.data()[k] > 0.0f;
      EXPECT_NEAR(covered_pixels(*mesh, X_CO, camera), covered, 0.01 * covered + 20.0);
    }
    EXPECT_EQ(covered_pixels(*mesh, Pose::from_translation({0.0, 0.0, 0.05}), camera), 0.0);
    EXPECT_EQ(covered_pixels(*mesh, Pose::from_translation({0.0, 0.0, -1.0}), camera), 0.0);
  }
  // Both sides of a sheet count once.
  geometry::TriangleMesh sheet;
  sheet.vertices = {{-0.1, -0.1, 0.0}, {0.1, -0.1, 0.0}, {0.1, 0.1, 0.0}, {-0.1, 0.1, 0.0}};
  sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
  const double expected = std::pow(0.2 * camera.fx, 2);
  for (const double turn : {0.0, 3.14159265})
    EXPECT_NEAR(covered_pixels(*make_render_mesh(sheet), {geometry::exp_rotation({turn, 0.0, 0.0}), {0, 0, 1}}, camera),
                expected, 0.01 * expected);
}

TEST_F(FramePyramidTest, TheCoarsestLevelWithEnoughPixelsIsChosen) {
  FramePyramid pyramid;
  const FramePyramidOptions options;
  ASSERT_TRUE(pyramid.reset(input_, options, SensorModel{}).ok());
  const MeshHandle ball = make_render_mesh(geometry::make_mesh(geometry::Sphere{0.05}, 40));
  int last = 0;
  for (double z = 0.4; z < 20.0; z *= 1.1) {
    const Pose X_CO = Pose::from_translation({0.0, 0.0, z});
    const int level = pyramid.level_for(*ball, X_CO);
    const double covered = covered_pixels(*ball, X_CO, input_.camera);
    const auto enough = [&](int i) { return covered / (64 >> (2 * i)) >= options.enough_pixels; };
    EXPECT_TRUE(enough(level) || level == 3) << z;
    EXPECT_TRUE(level == 0 || !enough(level - 1)) << z;
    EXPECT_GE(level, last) << "further away it is no coarser";
    last = level;
  }
  EXPECT_EQ(last, 3);
  EXPECT_EQ(pyramid.level_for(*ball, Pose::from_translation({0.0, 0.0, -1.0})), 3)
      << "the finest where nothing is seen";
}

TEST_F(FramePyramidTest, WhatDoesNotFitIsRefusedAndLeavesNoLevel) {
  FramePyramid pyramid;
  EXPECT_EQ(pyramid.levels(), 0);
  const auto refused = [&](const FrameTermsInput& input, const FramePyramidOptions& options) {
    const core::Status status = pyramid.reset(input, options, SensorModel{});
    return status.code() == core::StatusCode::kInvalidInput && pyramid.levels() == 0;
  };
  FramePyramidOptions no_width, negative, none, not_a_number;
  no_width.coarsest_width = 0;
  negative.finest_width = -1;
  none.enough_pixels = 0.0;
  not_a_number.enough_pixels = std::nan("");
  for (const FramePyramidOptions& options : {no_width, negative, none, not_a_number})
    EXPECT_TRUE(refused(input_, options));
  FrameTermsInput wrong = input_;
  wrong.camera.width = 320;
  EXPECT_TRUE(refused(wrong, {}));
}

}  // namespace
}  // namespace prescene::rendering
