// SPDX-License-Identifier: Apache-2.0
#include "prescene/geometry/lens.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/support/generators.h"
#include "tests/support/matchers.h"

namespace prescene::geometry::lens_test {
namespace {

using Eigen::Vector2d;
using testing::HasSubstr;
using tests::is_near;

TEST(LensDistortion, IsNoneUnlessGiven) {
  const LensDistortion lens;
  EXPECT_TRUE(lens.is_none());
  EXPECT_EQ(*lens.distort({3.0, -4.0}), Vector2d(3.0, -4.0));
  EXPECT_EQ(*lens.undistort({3.0, -4.0}), Vector2d(3.0, -4.0));
  EXPECT_TRUE(std::isinf(lens.max_radius()));
}

// At (0.3, -0.2), r^2 is 0.13: the radial factor is 1 - 0.3 * 0.13 + 0.1 * 0.0169 + 0.05 * 0.002197 = 0.96279985. The
// decentring adds 2 p1 x y + p2 (r^2 + 2 x^2) = -0.00012 - 0.00062 to x and
// p1 (r^2 + 2 y^2) + 2 p2 x y = 0.00021 + 0.00024 to y.
TEST(LensDistortion, OfPlumbBobIsAsWorkedOutByHand) {
  const LensDistortion lens = *LensDistortion::brown({-0.3, 0.1, 0.001, -0.002, 0.05, 0.0, 0.0, 0.0});
  EXPECT_THAT(*lens.distort({0.3, -0.2}),
              is_near(Vector2d(0.3 * 0.96279985 - 0.00074, -0.2 * 0.96279985 + 0.00045), 1e-15));
  EXPECT_EQ(*lens.distort({0.0, 0.0}), Vector2d(0.0, 0.0));
}

// At radius 1 the factor is (1 + 0.4 - 0.2 + 0.05) / (1 + 0.7 - 0.3 + 0.1) = 1.25 / 1.5.
TEST(LensDistortion, OfRationalPolynomialIsAsWorkedOutByHand) {
  const LensDistortion lens = *LensDistortion::brown({0.4, -0.2, 0.0, 0.0, 0.05, 0.7, -0.3, 0.1});
  EXPECT_THAT(*lens.distort({0.6, -0.8}), is_near(Vector2d(0.5, -0.8 / 1.2), 1e-15));
}

// 45 degrees off the axis, an ideal fisheye shows a radius of pi / 4; with k1 = 0.1, pi / 4 (1 + 0.1 (pi / 4)^2).
TEST(LensDistortion, OfEquidistantIsAsWorkedOutByHand) {
  const double angle = std::numbers::pi / 4.0;
  EXPECT_THAT(*LensDistortion::equidistant({})->distort({0.6, 0.8}), is_near(angle * Vector2d(0.6, 0.8), 1e-15));
  const LensDistortion lens = *LensDistortion::equidistant({0.1, 0.0, 0.0, 0.0});
  EXPECT_THAT(*lens.distort({0.0, -1.0}), is_near(Vector2d(0.0, -angle * (1.0 + 0.1 * angle * angle)), 1e-15));
}

// r (1 - r^2 / 2) is largest at r = sqrt(2 / 3), with two thirds of that as its value.
TEST(LensDistortion, EndsWhereItFolds) {
  const LensDistortion lens = *LensDistortion::brown({-0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0});
  const double fold = std::sqrt(2.0 / 3.0);
  EXPECT_NEAR(lens.max_radius(), fold, 1e-9);
  EXPECT_TRUE(lens.distort({fold - 1e-6, 0.0}));
  EXPECT_FALSE(lens.distort({fold + 1e-6, 0.0}));
  EXPECT_FALSE(lens.distort({1.3, 0.0})) << "the formula puts it at 0.2";
  EXPECT_TRUE(lens.undistort({fold * 2.0 / 3.0 - 1e-6, 0.0}));
  EXPECT_FALSE(lens.undistort({fold * 2.0 / 3.0 + 1e-6, 0.0}));
  EXPECT_FALSE(lens.undistort({std::numeric_limits<double>::infinity(), 0.0}));
}

TEST(LensDistortion, EndsAtAPole) {
  const LensDistortion lens = *LensDistortion::brown({0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0});
  EXPECT_LE(lens.max_radius(), 1.0);
  EXPECT_TRUE(lens.distort({0.9, 0.0}));
  EXPECT_FALSE(lens.distort({1.1, 0.0}));
}

TEST(LensDistortion, OfAFisheyeEndsShortOf90Degrees) {
  const LensDistortion lens = *LensDistortion::equidistant({});
  EXPECT_NEAR(std::atan(lens.max_radius()) * 180.0 / std::numbers::pi, 89.0, 0.01);
}

TEST(LensDistortion, RefusesWhatIsNotFinite) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(LensDistortion::brown({0.0, nan}).status().message(), HasSubstr("lens coefficient 1 is not finite"));
  EXPECT_EQ(LensDistortion::equidistant({0.0, 0.0, 0.0, HUGE_VAL}).status().code(), core::StatusCode::kInvalidInput);
}

TEST(LensDistortion, OfSenselessCoefficientsShowsNothingButIsSound) {
  for (const double huge : {1e30, -1e30, 1e300, -1e300}) {
    const LensDistortion lens = *LensDistortion::brown({huge, huge, huge, -huge, huge, -huge, huge, huge});
    for (const double x : {0.0, 1e-200, 1e-3, 0.5, 1e200}) {
      for (const auto& p : {lens.distort({x, -x}), lens.undistort({-x, x})}) EXPECT_TRUE(!p || p->allFinite());
    }
  }
}

}  // namespace
}  // namespace prescene::geometry::lens_test
