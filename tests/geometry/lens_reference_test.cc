// SPDX-License-Identifier: Apache-2.0
// Agreement with OpenCV 4.6: what cv::projectPoints and cv::fisheye::distortPoints of its part calib3d returned. The
// part itself is no dependency, as its headers come with 150 packages.
#include <gtest/gtest.h>

#include <vector>

#include "prescene/geometry/lens.h"
#include "tests/support/matchers.h"

namespace prescene::geometry::lens_reference_test {
namespace {

using Eigen::Vector2d;
using tests::is_near;

const std::vector<Vector2d> kPoints = {{0.3, -0.2}, {-0.7, 0.4}, {0.05, 0.9}, {1.1, 0.8}};

void expect_images(const LensDistortion& lens, const std::vector<Vector2d>& images) {
  for (std::size_t i = 0; i < kPoints.size(); ++i) {
    ASSERT_TRUE(lens.distort(kPoints[i]));
    EXPECT_THAT(*lens.distort(kPoints[i]), is_near(images[i], 1e-15));
    ASSERT_TRUE(lens.undistort(images[i]));
    EXPECT_THAT(*lens.undistort(images[i]), is_near(kPoints[i], 1e-13));
  }
}

TEST(LensDistortion, OfPlumbBobIsThatOfOpencv) {
  expect_images(*LensDistortion::brown({-0.3, 0.1, 0.001, -0.002, 0.05, 0.0, 0.0, 0.0}),
                {{0.28809995499999996, -0.19210997000000002},
                 {-0.606506875, 0.34648250000000008},
                 {0.040909223632812505, 0.766428525390625},
                 {1.2074343750000003, 0.88267500000000021}});
  expect_images(*LensDistortion::brown({0.08, -0.02, -0.003, 0.004, 0.0, 0.0, 0.0, 0.0}),
                {{0.30461860000000002, -0.20312240000000001},
                 {-0.72228499999999995, 0.41226999999999997},
                 {0.055589843750000006, 0.93967968750000008},
                 {1.1993050000000001, 0.86129000000000011}});
}

TEST(LensDistortion, OfRationalPolynomialIsThatOfOpencv) {
  expect_images(*LensDistortion::brown({0.4, -0.2, 0.0007, -0.0003, 0.02, 0.7, -0.3, 0.05}),
                {{0.28949854183209761, -0.19293402788806507},
                 {-0.61690655922446747, 0.35286160527112431},
                 {0.042883129744071262, 0.77685258539328272},
                 {0.82044576876481345, 0.59838646819259156}});
}

TEST(LensDistortion, OfEquidistantIsThatOfOpencv) {
  expect_images(*LensDistortion::equidistant({-0.03, 0.01, -0.004, 0.0007}),
                {{0.28693343272664168, -0.19128895515109445},
                 {-0.58202558677087746, 0.33258604958335858},
                 {0.040129696927057812, 0.72233454468704061},
                 {0.74179789760042381, 0.53948938007303548}});
  expect_images(*LensDistortion::equidistant({}), {{0.28792845070109141, -0.19195230046739431},
                                                   {-0.5891252287293075, 0.3366429878453186},
                                                   {0.040691770417031745, 0.73245186750657132},
                                                   {0.75764435003086583, 0.55101407274972058}});
}

}  // namespace
}  // namespace prescene::geometry::lens_reference_test
