// SPDX-License-Identifier: Apache-2.0
#include "prescene/rendering/gpu/egl_renderer.h"

#include <gtest/gtest.h>

#include <cstdlib>

#include "prescene/geometry/primitives.h"

namespace prescene::rendering {
namespace {

TEST(EglRenderer, NamesItsDevice) {
  ASSERT_TRUE(egl_compiled_in());
  const auto renderer = make_egl_renderer();
  if (!renderer) GTEST_SKIP() << renderer.status().message();
  EXPECT_EQ((*renderer)->info().name, "egl");
  EXPECT_FALSE((*renderer)->info().device.empty());
  EXPECT_GE((*renderer)->info().max_image_size, 2048);
  EXPECT_FALSE((*renderer)->info().deterministic_bits);
}

TEST(EglRenderer, DrawsOnAfterALostContext) {
  DeviceChoice choice;
  choice.faults = std::make_shared<GraphicsFaults>();
  const auto renderer = make_egl_renderer(choice);
  if (!renderer) GTEST_SKIP() << renderer.status().message();
  RenderScene scene;
  scene.instances = {{make_render_mesh(geometry::make_mesh(geometry::Sphere{0.2})),
                      geometry::Pose::from_translation({0, 0, 1}), SurfaceMaterial{}}};
  const geometry::PinholeCamera camera = {64, 48, 60.0, 60.0, 31.5, 23.5};
  RenderOptions options;
  options.color = true;
  RenderedView before;
  ASSERT_TRUE((*renderer)->render(scene, camera, geometry::Pose::identity(), options, &before).ok());
  for (std::atomic<int>* fault : {&choice.faults->losses, &choice.faults->resets}) {
    fault->store(1);
    RenderedView after;
    const core::Status status = (*renderer)->render(scene, camera, geometry::Pose::identity(), options, &after);
    ASSERT_TRUE(status.ok()) << status.message();
    EXPECT_EQ(fault->load(), 0);
    EXPECT_TRUE(after.depth == before.depth);
    EXPECT_TRUE(after.color == before.color);
  }
}

TEST(EglRenderer, SaysSoWhereNoContextComesAgainAndGoesOnWhenOneDoes) {
  DeviceChoice choice;
  choice.faults = std::make_shared<GraphicsFaults>();
  const auto renderer = make_egl_renderer(choice);
  if (!renderer) GTEST_SKIP() << renderer.status().message();
  const geometry::PinholeCamera camera = {64, 48, 60.0, 60.0, 31.5, 23.5};
  RenderedView view;
  const auto render = [&] { return (*renderer)->render({}, camera, geometry::Pose::identity(), {}, &view); };
  choice.faults->losses = 1;
  choice.faults->refusals = 1;
  EXPECT_EQ(render().code(), core::StatusCode::kUnavailable);
  EXPECT_TRUE(render().ok());
  choice.faults->losses = 2;  // the new one, too
  EXPECT_EQ(render().code(), core::StatusCode::kUnavailable);
  EXPECT_TRUE(render().ok());
}

TEST(EglRenderer, TakesTheDeviceThatIsChosen) {
  const std::vector<GraphicsDevice> devices = graphics_devices();
  DeviceChoice choice;
  choice.device = static_cast<int>(devices.size());
  EXPECT_EQ(make_egl_renderer(choice).status().code(), core::StatusCode::kInvalidInput);
  for (const GraphicsDevice& device : devices) {
    choice.device = device.index;
    const auto renderer = make_egl_renderer(choice);
    if (!renderer) {
      EXPECT_EQ(renderer.status().code(), core::StatusCode::kUnavailable);
    } else {
      EXPECT_FALSE((*renderer)->info().device.empty());
    }
  }
}

TEST(EglRenderer, NamesThePackageWhereNoDriverIsFound) {
  // libEGL looks for its drivers where this variable says; in a process of its own, since it looks once.
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(
      {
        setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/nonexistent.json", 1);
        const auto renderer = make_egl_renderer();
        const bool named = !renderer && renderer.status().code() == core::StatusCode::kUnavailable &&
                           renderer.status().message().find("libegl-mesa0") != std::string::npos;
        std::exit(named ? 0 : 1);
      },
      testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace prescene::rendering
