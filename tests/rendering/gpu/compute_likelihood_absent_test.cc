// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "prescene/rendering/gpu/compute_likelihood.h"
#include "prescene/rendering/simd/simd_likelihood.h"

namespace prescene::rendering {
namespace {

// This program links the library of builds without OpenGL.
TEST(ComputeLikelihoodAbsent, SaysThatTheBuildLeftItOutAndWhatToDo) {
  EXPECT_FALSE(compute_compiled_in());
  EXPECT_TRUE(graphics_devices().empty());
  const auto batch = make_compute_likelihood_batch(make_simd_likelihood_batch(), {});
  ASSERT_FALSE(batch.ok());
  EXPECT_EQ(batch.status().code(), core::StatusCode::kUnavailable);
  EXPECT_NE(batch.status().message().find("PRESCENE_EGL=ON"), std::string::npos);
}

}  // namespace
}  // namespace prescene::rendering
