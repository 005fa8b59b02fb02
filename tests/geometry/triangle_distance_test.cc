// SPDX-License-Identifier: Apache-2.0
#include "prescene/geometry/triangle_distance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "prescene/core/random.h"
#include "prescene/geometry/sampling.h"

namespace prescene::geometry {
namespace {

TEST(TriangleDistance, IsThatOfTheNearestOfManyPointsOfTheTriangle) {
  core::RandomStream stream(3, core::Purpose::kTest);
  const auto anywhere = [&] {
    const Vector3d direction = uniform_direction(stream);
    return Vector3d(stream.uniform() * direction);
  };
  for (int round = 0; round < 200; ++round) {
    const Vector3d a = anywhere(), b = anywhere(), c = anywhere(), p = 2.0 * anywhere();
    const double found = std::sqrt(squared_distance_to_triangle(p, a, b, c));
    double nearest = std::numeric_limits<double>::max();
    constexpr int kSteps = 100;
    for (int i = 0; i <= kSteps; ++i) {
      for (int k = 0; i + k <= kSteps; ++k) {
        const Vector3d q = (i * a + k * b + (kSteps - i - k) * c) / kSteps;
        nearest = std::min(nearest, (p - q).norm());
      }
    }
    EXPECT_LE(found, nearest + 1e-12);
    EXPECT_GE(found, nearest - 2.0 / kSteps) << "points of the triangle are this near to one of the grid";
  }
}

TEST(TriangleDistance, OfATriangleWithoutAreaIsThatOfWhatIsLeft) {
  const Vector3d a(0.0, 0.0, 0.0), b(1.0, 0.0, 0.0), p(0.5, 2.0, 0.0);
  EXPECT_DOUBLE_EQ(squared_distance_to_triangle(p, a, b, 0.5 * b), 4.0);
  EXPECT_DOUBLE_EQ(squared_distance_to_triangle(p, a, a, b), 4.0);
  EXPECT_DOUBLE_EQ(squared_distance_to_triangle(p, b, b, b), 4.25);
}

}  // namespace
}  // namespace prescene::geometry
