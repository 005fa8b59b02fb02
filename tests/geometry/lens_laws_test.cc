// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>

#include "prescene/geometry/lens.h"
#include "tests/support/generators.h"

namespace prescene::geometry::lens_laws_test {
namespace {

using Eigen::Vector2d;
using tests::numbers;

LensDistortion any_brown(bool rational) {
  std::array<double, 8> k = {*numbers(-0.5, 0.5), *numbers(-0.3, 0.3), *numbers(-0.005, 0.005), *numbers(-0.005, 0.005),
                             *numbers(-0.1, 0.1)};
  for (std::size_t i = 5; i < 8 && rational; ++i) k[i] = *numbers(-0.5, 0.5);
  return *LensDistortion::brown(k);
}

LensDistortion any_fisheye() {
  return *LensDistortion::equidistant(
      {*numbers(-0.1, 0.1), *numbers(-0.05, 0.05), *numbers(-0.02, 0.02), *numbers(-0.01, 0.01)});
}

/// A point well inside of where the lens has an image, and of any picture.
Vector2d point_inside(const LensDistortion& lens) {
  const double radius = *numbers(0.0, 0.9) * std::min(lens.max_radius(), 2.5);
  const double turn = *numbers(0.0, 6.3);
  return radius * Vector2d(std::cos(turn), std::sin(turn));
}

template <class Lens>
void check_inverse(const Lens& any_lens) {
  EXPECT_TRUE(tests::check_law([&] {
    const LensDistortion lens = any_lens();
    const Vector2d p = point_inside(lens);
    const auto q = lens.distort(p);
    if (!q) return;  // strong decentring folds a little earlier
    const auto back = lens.undistort(*q);
    RC_ASSERT(back.has_value());
    // 0.9 of the radius of a fold is at one, where the inverse is ten times as steep.
    RC_ASSERT((*back - p).norm() < 1e-9);
  }));
}

TEST(LensLaws, UndistortingIsTheInverseOfPlumbBob) {
  check_inverse([] { return any_brown(false); });
}
TEST(LensLaws, UndistortingIsTheInverseOfRationalPolynomial) {
  check_inverse([] { return any_brown(true); });
}
TEST(LensLaws, UndistortingIsTheInverseOfEquidistant) {
  check_inverse([] { return any_fisheye(); });
}

TEST(LensLaws, WhatUndistortsIsInsideAndDistortsBack) {
  EXPECT_TRUE(tests::check_law([] {
    const LensDistortion lens = *numbers(0.0, 1.0) < 0.5 ? any_brown(true) : any_fisheye();
    const Vector2d q(*numbers(-2.0, 2.0), *numbers(-2.0, 2.0));
    const auto p = lens.undistort(q);
    if (!p) return;
    RC_ASSERT(p->norm() <= lens.max_radius() * (1.0 + 1e-12));
    const auto again = lens.distort(*p);
    RC_ASSERT(!again || (*again - q).norm() < 1e-9);
  }));
}

TEST(LensLaws, ImagesGrowOutwardsUpToTheFold) {
  EXPECT_TRUE(tests::check_law([] {
    LensDistortion lens = any_fisheye();
    double before = -1.0;
    for (int i = 0; i <= 100; ++i) {
      const auto q = lens.distort({0.0, std::min(lens.max_radius(), 50.0) * i * 0.00999});
      RC_ASSERT(q.has_value());
      RC_ASSERT(q->y() > before);
      before = q->y();
    }
  }));
}

}  // namespace
}  // namespace prescene::geometry::lens_laws_test
