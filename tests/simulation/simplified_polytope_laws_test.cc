// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/simplified_polytope.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "prescene/core/random.h"
#include "prescene/geometry/primitives.h"
#include "prescene/geometry/sampling.h"

namespace prescene::simulation {
namespace {

ConvexPolytope ball_of_points(int count) {
  core::RandomStream stream(1, core::Purpose::kTest);
  std::vector<Vector3d> points;
  for (int i = 0; i < count; ++i) {
    const double z = stream.normal(), y = stream.normal(), x = stream.normal();
    points.emplace_back(0.05 * Vector3d(x, y, z).normalized());
  }
  return *make_polytope(points);
}

bool is_one_of(const Vector3d& p, const std::vector<Vector3d>& points) {
  return std::find(points.begin(), points.end(), p) != points.end();
}

double height_above(const ConvexPolytope& polytope, const Vector3d& p) {
  double height = -1.0;
  for (const auto& face : polytope.faces) height = std::max(height, face.normal.dot(p) - face.offset);
  return height;
}

TEST(SimplifiedPolytope, IsInsideAndNoFartherThanItsErrorSays) {
  const ConvexPolytope ball = ball_of_points(1500);
  double before = 1.0;
  for (const std::size_t vertices : {16, 32, 64, 128}) {
    const auto few = simplified(ball, {vertices, 16});
    ASSERT_TRUE(few.ok()) << few.status().message();
    EXPECT_TRUE(within(few->polytope, {vertices, 16}));
    for (const Vector3d& v : few->polytope.vertices) EXPECT_TRUE(is_one_of(v, ball.vertices));
    for (const Vector3d& v : ball.vertices) EXPECT_LE(height_above(few->polytope, v), few->error + 1e-12);
    EXPECT_LT(few->error, before);
    before = few->error;
    // The best that so many points on a sphere can do is about 2 pi / (sqrt(3) n) of its radius [Fejes Toth 1953].
    EXPECT_LT(few->error, 3.0 * 0.05 * 2.0 * std::numbers::pi / (std::sqrt(3.0) * static_cast<double>(vertices)));
  }
}

TEST(SimplifiedPolytope, OfFewVerticesIsItself) {
  const ConvexPolytope box = *make_polytope(geometry::make_mesh(geometry::BoxShape{{0.1, 0.2, 0.3}}).vertices);
  const auto same = simplified(box, {16, 16});
  ASSERT_TRUE(same.ok());
  EXPECT_EQ(same->polytope.vertices, box.vertices);
  EXPECT_EQ(same->error, 0.0);
}

TEST(SimplifiedPolytope, RestsOnTheSameFaces) {
  // A bottle: its foot has 64 corners and is far smaller than its sides together.
  const auto bottle = make_polytope(
      geometry::make_lathe(
          {{0.0, -0.1}, {0.03, -0.1}, {0.035, -0.09}, {0.035, 0.05}, {0.012, 0.09}, {0.012, 0.12}, {0.0, 0.12}}, 64)
          .vertices);
  ASSERT_TRUE(bottle.ok());
  ASSERT_FALSE(within(*bottle, {64, 16}));
  const auto few = rounded(*bottle, 2e-4, {64, 16});
  ASSERT_TRUE(few.ok()) << few.status().message();
  EXPECT_TRUE(within(few->core, {64, 16}));
  EXPECT_EQ(few->radius, 2e-4);
  EXPECT_LT(few->error, 2e-3);
  const auto foot = std::find_if(few->core.faces.begin(), few->core.faces.end(),
                                 [](const auto& face) { return face.normal.z() < -0.9999; });
  ASSERT_NE(foot, few->core.faces.end());
  EXPECT_NEAR(foot->offset + few->radius, 0.1, 1e-9);
  // It stands on nearly the whole foot: the least radius of what is left of a circle by 12 corners is cos(15 deg).
  for (std::size_t k = 0; k < foot->loop.size(); ++k) {
    const Vector3d& a = few->core.vertices[foot->loop[k]];
    const Vector3d& b = few->core.vertices[foot->loop[(k + 1) % foot->loop.size()]];
    EXPECT_GT((0.5 * (a + b)).head<2>().norm(), 0.9 * 0.03);
  }
}

}  // namespace
}  // namespace prescene::simulation
