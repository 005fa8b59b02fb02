// SPDX-License-Identifier: Apache-2.0
#include "prescene/rendering/egl/egl_renderer.h"

#include <gtest/gtest.h>

#include <cstdlib>

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
