// SPDX-License-Identifier: Apache-2.0
// Signs of determinants against rational arithmetic.
#include "prescene/collision/orientation.h"

#include <gtest/gtest.h>

#include <cmath>

#include "nasty_triangles.h"
#include "prescene/collision/expansion.h"
#include "rational_reference.h"

namespace prescene::collision::orientation_reference_test {
namespace {

TEST(Orientation, HasTheSignOfTheRationalDeterminant) {
  core::RandomStream random(3, core::Purpose::kTest);
  int zero = 0;
  for (const Nastiness nastiness : kAllNastiness) {
    for (int i = 0; i < 2000; ++i) {
      const auto [a, b] = nasty_pair(nastiness, random);
      const int sign = orientation(a[0], a[1], a[2], b[0]);
      ASSERT_EQ(sign, rational_orientation(a[0], a[1], a[2], b[0])) << to_string(nastiness) << " " << i;
      ASSERT_EQ(orientation(a[1], a[0], a[2], b[0]), -sign);
      ASSERT_EQ(orientation(b[0], a[1], a[2], a[0]), -sign);
      zero += sign == 0 ? 1 : 0;
      for (int axis = 0; axis < 3; ++axis) {
        // Seen along the axis: with a fourth point far along it.
        const Vector3f lifted = a[0] + Vector3f::Unit(axis) * 4.0F * kLargestCoordinate;
        ASSERT_EQ(orientation_along(axis, a[0], a[1], a[2]), rational_orientation(a[0], a[1], a[2], lifted));
      }
    }
  }
  EXPECT_GT(zero, 500);
}

TEST(Orientation, SeesOneUnitInTheLastPlace) {
  // A plane through points that are rounded apart: the corner of a float grid on it, and its neighbours beside it.
  const Vector3f a(1e9F, -1e9F, 1e-30F);
  const Vector3f b(-1e9F, 1e9F, 1e-30F);
  const Vector3f c(0.0F, 0.0F, 1e9F);
  const Vector3f on(3.0F, -3.0F, 5.0F);
  EXPECT_EQ(orientation(a, b, c, on), 0);
  const float up = std::nextafter(3.0F, 4.0F);
  EXPECT_EQ(orientation(a, b, c, Vector3f(up, -3.0F, 5.0F)), -orientation(a, b, c, Vector3f(3.0F, -up, 5.0F)));
  EXPECT_NE(orientation(a, b, c, Vector3f(up, -3.0F, 5.0F)), 0);
  EXPECT_NE(orientation(a, b, c, on + Vector3f(1e-38F, 0.0F, 0.0F)), 1);
}

TEST(Expansion, KeepsWhatDoublesLose) {
  Expansion<8> sum;
  for (const double value : {1.0, 1e-200, 1e100, -1.0, -1e100}) sum.add(value);
  EXPECT_EQ(sum.sign(), 1);
  ASSERT_EQ(sum.terms().size(), 1U);
  EXPECT_EQ(sum.terms()[0], 1e-200);
  const TwoTerms square = exact_product(1.0 + std::ldexp(1.0, -40), 1.0 + std::ldexp(1.0, -40));
  EXPECT_EQ(square.tail, std::ldexp(1.0, -80));
}

}  // namespace
}  // namespace prescene::collision::orientation_reference_test
