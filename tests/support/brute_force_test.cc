// SPDX-License-Identifier: Apache-2.0
#include "tests/support/brute_force.h"

#include <gmock/gmock.h>

#include <cmath>

#include "prescene/collision/exact_triangles.h"
#include "prescene/geometry/primitives.h"
#include "tests/support/collision_meshes.h"
#include "tests/support/contact_configurations.h"

namespace prescene::tests {
namespace {

using collision::Mesh;
using collision::Transform;

bool collide_without_boxes(const Mesh& a, const Mesh& b, const Transform& X_AB) {
  for (std::uint32_t j = 0; j < b.triangle_count(); ++j) {
    collision::Triangle placed = b.corners(j);
    for (Eigen::Vector3f& corner : placed) corner = X_AB * corner;
    for (std::uint32_t i = 0; i < a.triangle_count(); ++i)
      if (collision::triangles_intersect(a.corners(i), placed)) return true;
  }
  return false;
}

Transform at(float x, float y, float z) {
  Transform X_AB;
  X_AB.translation = {x, y, z};
  return X_AB;
}

TEST(BruteForce, LeavesOutNoPair) {
  const auto a = collision_mesh(make_knot(0.1, 400), "knot");
  const auto b = collision_mesh(geometry::make_mesh(geometry::BoxShape{{0.05, 0.02, 0.1}}), "box");
  ContactConfigurations make(a, b, {}, 11);
  int colliding = 0;
  for (const Transform& X_AB : make.scattered(1000)) {
    const bool collides = collide_by_brute_force(*a, *b, X_AB);
    EXPECT_EQ(collides, collide_without_boxes(*a, *b, X_AB));
    EXPECT_EQ(distance_by_brute_force(*a, *b, X_AB, 0.02) == 0.0, collides);
    colliding += collides ? 1 : 0;
  }
  EXPECT_GT(colliding, 100);
  EXPECT_LT(colliding, 900);
}

TEST(BruteForce, DistancesOfBoxes) {
  const auto cube = collision_mesh(geometry::make_mesh(geometry::BoxShape{{1.0, 1.0, 1.0}}), "cube");
  // Faces, edges and corners that are next to each other; touching; one inside the other without contact of surfaces.
  EXPECT_NEAR(distance_by_brute_force(*cube, *cube, at(1.25F, 0.0F, 0.0F), 10.0), 0.25, 1e-12);
  EXPECT_NEAR(distance_by_brute_force(*cube, *cube, at(1.3F, 1.4F, 0.0F), 10.0), 0.5, 1e-7);
  EXPECT_NEAR(distance_by_brute_force(*cube, *cube, at(1.25F, 1.25F, 1.125F), 10.0), std::sqrt(0.140625), 1e-7);
  EXPECT_EQ(distance_by_brute_force(*cube, *cube, at(1.0F, 0.5F, 0.0F), 10.0), 0.0);
  const auto small = collision_mesh(geometry::make_mesh(geometry::BoxShape{{0.5, 0.5, 0.5}}), "small");
  EXPECT_NEAR(distance_by_brute_force(*cube, *small, at(0.125F, 0.0F, 0.0F), 10.0), 0.125, 1e-12);
}

TEST(BruteForce, DistanceStopsAtTheLimit) {
  const auto ball = collision_mesh(geometry::make_mesh(geometry::Sphere{0.1}, 16), "ball");
  EXPECT_EQ(distance_by_brute_force(*ball, *ball, at(0.5F, 0.0F, 0.0F), 0.1), 0.1);
  const double distance = distance_by_brute_force(*ball, *ball, at(0.5F, 0.2F, 0.1F), 1.0);
  EXPECT_EQ(distance_by_brute_force(*ball, *ball, at(0.5F, 0.2F, 0.1F), distance * 1.01), distance);
}

/// Edges that cross at a distance, parallel edges and edges without length.
TEST(BruteForce, DistancesOfNeedles) {
  const auto needle = [](const Eigen::Vector3f& p, const Eigen::Vector3f& q) {
    return Mesh::make(std::vector<Eigen::Vector3f>{p, q, q}, std::vector<collision::TriangleIndices>{{0, 1, 2}},
                      "needle");
  };
  const auto along_x = needle({-1, 0, 0}, {1, 0, 0}), along_y = needle({0, -1, 0}, {0, 1, 0}),
             point = needle({0, 0, 0}, {0, 0, 0});
  EXPECT_NEAR(distance_by_brute_force(**along_x, **along_y, at(0.5F, 0.5F, 0.25F), 5.0), 0.25, 1e-15);
  EXPECT_NEAR(distance_by_brute_force(**along_x, **along_x, at(0.5F, 0.0F, 0.25F), 5.0), 0.25, 1e-15);
  EXPECT_NEAR(distance_by_brute_force(**along_x, **along_x, at(2.5F, 0.0F, 0.0F), 5.0), 0.5, 1e-15);
  EXPECT_NEAR(distance_by_brute_force(**along_x, **point, at(0.5F, 0.5F, 0.0F), 5.0), 0.5, 1e-15);
  EXPECT_NEAR(distance_by_brute_force(**point, **point, at(3.0F, 4.0F, 0.0F), 9.0), 5.0, 1e-15);
}

}  // namespace
}  // namespace prescene::tests
