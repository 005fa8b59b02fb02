// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/spheres/sphere_packing.h"

#include <gmock/gmock.h>

#include <limits>
#include <numbers>

namespace prescene::collision::sphere_packing_test {
namespace {

using ::testing::HasSubstr;

const SurfaceAnchor kUp{Vector3f(0, 0, 1), Vector3f(0, 0, 1)};

TEST(SpherePacking, KnowsItsVolume) {
  const auto packing = SpherePacking::make({{Vector3f(0, 0, 0), 1.0F}, {Vector3f(3, 0, 0), 2.0F}}, {kUp, kUp}, "two");
  ASSERT_TRUE(packing.ok());
  EXPECT_NEAR((*packing)->volume(), 4.0 / 3.0 * std::numbers::pi * 9.0, 1e-12);
  const auto named_otherwise =
      SpherePacking::make({{Vector3f(0, 0, 0), 1.0F}, {Vector3f(3, 0, 0), 2.0F}}, {kUp, kUp}, "b");
  EXPECT_EQ((*packing)->content_hash(), (*named_otherwise)->content_hash());
}

TEST(SpherePacking, RefusesBadSpheres) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const auto message = [](std::vector<PackedSphere> spheres, std::vector<SurfaceAnchor> anchors) {
    return SpherePacking::make(std::move(spheres), std::move(anchors), "cup").status().message();
  };
  EXPECT_THAT(message({}, {}), HasSubstr("'cup': it has no spheres"));
  EXPECT_THAT(message({{Vector3f(0, 0, 0), 1.0F}}, {}), HasSubstr("0 anchors for 1"));
  EXPECT_THAT(message({{Vector3f(0, 0, 0), 1.0F}, {Vector3f(0, nan, 0), 1.0F}}, {kUp, kUp}),
              HasSubstr("sphere 1 is not finite"));
  EXPECT_THAT(message({{Vector3f(2e9F, 0, 0), 1.0F}}, {kUp}), HasSubstr("1e9 m"));
  EXPECT_THAT(message({{Vector3f(0, 0, 0), 0.0F}}, {kUp}), HasSubstr("not positive"));
  EXPECT_THAT(message({{Vector3f(0, 0, 0), 1.0F}}, {{Vector3f(0, 0, 1), Vector3f(0, 0, 0)}}), HasSubstr("unit length"));
}

}  // namespace
}  // namespace prescene::collision::sphere_packing_test
