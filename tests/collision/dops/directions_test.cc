// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/dops/directions.h"

#include <gtest/gtest.h>

#include <cmath>

#include "prescene/core/random.h"

namespace prescene::collision {
namespace {

double dot(const DopAxis& a, const DopAxis& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

TEST(DopDirections, AreUnitVectorsFarFromEachOther) {
  // The widest gap to the nearest other line, in degrees, that the axes leave: at least.
  for (const auto& [k, gap] :
       {std::pair{6, 89.9}, {14, 54.7}, {18, 44.9}, {24, 35.0}, {26, 35.2}, {32, 30.0}, {46, 24.0}}) {
    const DopDirections& directions = DopDirections::of(k);
    ASSERT_EQ(directions.k(), k);
    double nearest = 0.0;
    for (std::size_t i = 0; i < directions.axes().size(); ++i) {
      EXPECT_NEAR(dot(directions.axes()[i], directions.axes()[i]), 1.0, 1e-12);
      for (std::size_t j = 0; j < i; ++j)
        nearest = std::max(nearest, std::abs(dot(directions.axes()[i], directions.axes()[j])));
    }
    EXPECT_GT(std::acos(nearest) * 180.0 / 3.14159265358979, gap) << k;
    for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(directions.axes()[i][i], 1.0);
    for (std::size_t p = 0; p < 2 * directions.axes().size(); ++p)
      EXPECT_NEAR(dot(directions.direction(p), directions.direction(directions.opposite(p))), -1.0, 1e-12);
  }
}

TEST(DopDirections, ConesAddUpToTheDirection) {
  core::RandomStream random(1, core::Purpose::kTest);
  for (const int k : kDopSizes) {
    const DopDirections& directions = DopDirections::of(k);
    const auto expect_sum = [&](const DopAxis& wanted) {
      const DopCone cone = directions.cone(wanted);
      DopAxis sum = {0, 0, 0};
      for (std::size_t n = 0; n < 3; ++n) {
        ASSERT_GE(cone.weights[n], 0.0);
        for (std::size_t c = 0; c < 3; ++c) sum[c] += cone.weights[n] * directions.direction(cone.directions[n])[c];
      }
      for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(sum[c], wanted[c], 1e-12) << k;
    };
    for (int i = 0; i < 2000; ++i) expect_sum({random.normal(), random.normal(), random.normal()});
    for (std::size_t p = 0; p < static_cast<std::size_t>(k); ++p) {
      const DopAxis own = directions.direction(p);
      expect_sum(own);
      const DopCone cone = directions.cone(own);
      EXPECT_NEAR(cone.weights[0] + cone.weights[1] + cone.weights[2], 1.0, 1e-12);
    }
  }
}

}  // namespace
}  // namespace prescene::collision
