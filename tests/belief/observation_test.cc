// SPDX-License-Identifier: Apache-2.0
#include "prescene/belief/observation.h"

#include <gtest/gtest.h>

namespace prescene::belief {
namespace {

std::shared_ptr<const geometry::DepthImage> depth_of(float value) {
  return std::make_shared<geometry::DepthImage>(4, 3, value);
}

TEST(Observation, ImagesCompareByContent) {
  Observation a;
  a.frame.depth = depth_of(1.25F);
  a.robot["hand"] = Pose::from_translation({0.1, 0.2, 0.3});
  Observation b = a;
  b.frame.depth = depth_of(1.25F);
  EXPECT_EQ(a, b);
  b.frame.depth = depth_of(1.26F);
  EXPECT_NE(a, b);
  b.frame.depth = nullptr;
  EXPECT_NE(a, b);
  EXPECT_NE(b, a);
  b = a;
  b.frame.color = std::make_shared<geometry::ColorImage>(4, 3);
  EXPECT_NE(a, b);
}

}  // namespace
}  // namespace prescene::belief
