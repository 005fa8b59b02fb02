// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "prescene/rendering/gpu/egl_renderer.h"

namespace prescene::rendering {
namespace {

// This program links the library of builds without OpenGL.
TEST(EglRendererAbsent, SaysThatTheBuildLeftItOutAndWhatToDo) {
  EXPECT_FALSE(egl_compiled_in());
  const auto renderer = make_egl_renderer();
  ASSERT_FALSE(renderer.ok());
  EXPECT_EQ(renderer.status().code(), core::StatusCode::kUnavailable);
  EXPECT_NE(renderer.status().message().find("PRESCENE_EGL=ON"), std::string::npos);
}

}  // namespace
}  // namespace prescene::rendering
