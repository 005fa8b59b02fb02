// SPDX-License-Identifier: Apache-2.0
// Depths of overlapping solids against closed forms, and what their bounds promise.
#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <optional>

#include "prescene/collision/distance_queries.h"
#include "prescene/collision/penetration.h"
#include "prescene/core/random.h"
#include "prescene/geometry/primitives.h"
#include "tests/support/allocations.h"
#include "tests/support/brute_force.h"
#include "tests/support/collision_meshes.h"
#include "tests/support/contact_configurations.h"

namespace prescene::collision::penetration_laws_test {
namespace {

using geometry::Pose;
using geometry::Vector3d;

TriangleTree tree_of(const geometry::TriangleMesh& mesh) {
  core::ThreadPool pool(1);
  return TriangleTree::build(tests::collision_mesh(mesh, "mesh"), {}, pool);
}

Transform transform_of(const Pose& X_AB) {
  const auto made = to_transform(X_AB);
  EXPECT_TRUE(made.ok());
  return *made;
}

Vector3d direction_from(core::RandomStream& random) {
  Vector3d v;
  do {
    const double z = random.normal(), y = random.normal(), x = random.normal();
    v = Vector3d(x, y, z);
  } while (v.norm() < 0.1);
  return v.normalized();
}

geometry::Quaterniond rotation_from(core::RandomStream& random) {
  const double z = random.normal(), y = random.normal(), x = random.normal(), w = random.normal();
  return geometry::Quaterniond(w, x, y, z).normalized();
}

/// How often the surface of a closed mesh winds around a point: the solid angles of its triangles
/// [van Oosterom and Strackee 1983].
double winding_number(const Mesh& mesh, const Vector3d& p) {
  double angle = 0.0;
  for (std::uint32_t i = 0; i < mesh.triangle_count(); ++i) {
    std::array<Vector3d, 3> v;
    for (std::size_t k = 0; k < 3; ++k) v[k] = mesh.corners(i)[k].cast<double>() - p;
    const double n0 = v[0].norm(), n1 = v[1].norm(), n2 = v[2].norm();
    angle += std::atan2(v[0].dot(v[1].cross(v[2])),
                        n0 * n1 * n2 + v[0].dot(v[1]) * n2 + v[1].dot(v[2]) * n0 + v[2].dot(v[0]) * n1);
  }
  return angle / (2.0 * M_PI);
}

/// Whether corners of B are inside of A: all of small meshes, some of large ones.
bool some_corner_inside(const Mesh& a, const Mesh& b, const Transform& X_AB) {
  constexpr std::uint32_t kMostAngles = 200'000;
  const std::uint32_t step = 1 + a.triangle_count() * b.triangle_count() / kMostAngles;
  for (std::uint32_t i = 0; i < b.triangle_count(); i += step) {
    if (winding_number(a, (X_AB * b.corners(i)[0]).cast<double>()) > 0.5) return true;
  }
  return false;
}

/// By other means than the query's.
bool apart(const TriangleTree& a, const TriangleTree& b, const Transform& X_AB) {
  return !tests::collide_by_brute_force(a.mesh(), b.mesh(), X_AB) && !some_corner_inside(a.mesh(), b.mesh(), X_AB) &&
         !some_corner_inside(b.mesh(), a.mesh(), inverse(X_AB));
}

/// What holds for any two solids.
void expect_bounds(const TriangleTree& a, const TriangleTree& b, const Transform& X_AB, const Penetration& found,
                   PenetrationScratch* scratch) {
  EXPECT_TRUE(apart(a, b, found.X_AB_apart));
  EXPECT_GE(found.depth, found.least);
  EXPECT_GE(found.least, 0.0);
  EXPECT_NEAR(found.direction.norm(), 1.0, 1e-9);
  EXPECT_FALSE(collide(a, b, found.X_AB_apart, scratch->queries()));
  EXPECT_FALSE(penetration(a, b, found.X_AB_apart, {}, *scratch).has_value());
  const double size = static_cast<double>(a.radius()) + static_cast<double>(b.radius());
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(found.X_AB_apart.rotation[2 * i], X_AB.rotation[2 * i]);
    const double moved =
        static_cast<double>(found.X_AB_apart.translation[i]) - static_cast<double>(X_AB.translation[i]);
    EXPECT_NEAR(moved, found.depth * found.direction[static_cast<int>(i)], 1e-6 * size);
  }
}

TEST(Penetration, OfSpheresIsTheirOverlap) {
  constexpr double kRadiusA = 0.1, kRadiusB = 0.06;
  const TriangleTree a = tree_of(geometry::make_mesh(geometry::Sphere{kRadiusA}, 96));
  const TriangleTree b = tree_of(geometry::make_mesh(geometry::Sphere{kRadiusB}, 64));
  // Of the inscribed polyhedra.
  constexpr double kFlat = 3e-4;
  core::RandomStream random(1, {});
  PenetrationScratch scratch;
  for (int i = 0; i < 100; ++i) {
    const double apart = 0.02 + 0.16 * random.uniform();
    Pose pose = Pose::from_translation(apart * direction_from(random));
    pose.rotation = rotation_from(random);
    const Transform X_AB = transform_of(pose);
    const std::optional<Penetration> found = penetration(a, b, X_AB, {}, scratch);
    const double expected = kRadiusA + kRadiusB - apart;
    if (!found) {
      EXPECT_LT(expected, 2.0 * kFlat);
      continue;
    }
    expect_bounds(a, b, X_AB, *found, &scratch);
    EXPECT_LE(found->depth, expected * 1.01 + 1e-5);
    EXPECT_GE(found->depth, expected - 2.0 * kFlat);
    EXPECT_LE(found->least, expected + 1e-6);
    EXPECT_GE(found->least, 0.9 * expected - 2.0 * kFlat);
    if (expected > 0.01) {
      EXPECT_GT(found->direction.dot(pose.translation.normalized()), 0.98);
    }
  }
}

/// The depth of two boxes: the least overlap along the axes of their faces and across their edges.
double depth_of_boxes(const Vector3d& half_a, const Vector3d& half_b, const Pose& X_AB) {
  const Eigen::Matrix3d R = X_AB.rotation.toRotationMatrix();
  double least = std::numeric_limits<double>::infinity();
  const auto along = [&](const Vector3d& axis) {
    if (axis.norm() < 1e-6) return;
    const Vector3d u = axis.normalized();
    const double reach = u.cwiseAbs().dot(half_a) + (R.transpose() * u).cwiseAbs().dot(half_b);
    least = std::min(least, reach - std::abs(u.dot(X_AB.translation)));
  };
  for (int i = 0; i < 3; ++i) {
    along(Vector3d::Unit(i));
    along(R.col(i));
    for (int k = 0; k < 3; ++k) along(Vector3d::Unit(i).cross(R.col(k)));
  }
  return least;
}

TEST(Penetration, OfBoxesIsTheirLeastOverlap) {
  const Vector3d half_a(0.1, 0.07, 0.04), half_b(0.05, 0.06, 0.03);
  const TriangleTree a = tree_of(geometry::make_mesh(geometry::BoxShape{2.0 * half_a}));
  const TriangleTree b = tree_of(geometry::make_mesh(geometry::BoxShape{2.0 * half_b}));
  core::RandomStream random(2, {});
  PenetrationScratch scratch;
  int overlapping = 0;
  double worst = 1.0;
  double sum_of_shares = 0.0;
  for (int i = 0; i < 300; ++i) {
    const Vector3d direction = direction_from(random);
    Pose pose = Pose::from_translation(0.15 * random.uniform() * direction);
    if (i % 3 != 0) pose.rotation = rotation_from(random);
    const Transform X_AB = transform_of(pose);
    const double expected = depth_of_boxes(half_a, half_b, pose);
    const std::optional<Penetration> found = penetration(a, b, X_AB, {}, scratch);
    if (std::abs(expected) > 1e-6) {
      EXPECT_EQ(found.has_value(), expected > 0.0);
    }
    if (!found) continue;
    expect_bounds(a, b, X_AB, *found, &scratch);
    EXPECT_GE(found->depth, expected - 1e-6);
    EXPECT_LE(found->least, expected + 1e-6);
    if (expected > 1e-3) worst = std::max(worst, found->depth / expected);
    sum_of_shares += found->least / found->depth;
    ++overlapping;
  }
  std::printf("%d overlapping boxes: depth at most %.3f of the exact one, lower bound %.2f of it on average\n",
              overlapping, worst, sum_of_shares / overlapping);
  EXPECT_GT(overlapping, 100);
  EXPECT_LT(worst, 1.05);
}

TEST(Penetration, TakesAnyTolerance) {
  const TriangleTree box = tree_of(geometry::make_mesh(geometry::BoxShape{{0.1, 0.07, 0.04}}));
  PenetrationScratch scratch;
  for (const double tolerance : {std::numeric_limits<double>::quiet_NaN(), -1.0, 0.0, 1.0, 1e3, 1e300,
                                 std::numeric_limits<double>::infinity()}) {
    const std::optional<Penetration> found = penetration(box, box, Transform{}, {.tolerance = tolerance}, scratch);
    ASSERT_TRUE(found.has_value());
    EXPECT_GE(found->depth, 0.04 - 1e-6);
    EXPECT_LE(found->depth, 0.5) << "within twice the way out at most";
  }
}

TEST(Penetration, IsThatOfABodyInsideAnother) {
  const TriangleTree a = tree_of(geometry::make_mesh(geometry::BoxShape{{0.3, 0.4, 0.5}}));
  const TriangleTree b = tree_of(geometry::make_mesh(geometry::BoxShape{{0.02, 0.02, 0.02}}));
  PenetrationScratch scratch;
  const Transform X_AB = transform_of(Pose::from_translation({0.1, 0.0, 0.0}));
  ASSERT_FALSE(collide(a, b, X_AB, scratch.queries()));
  const std::optional<Penetration> found = penetration(a, b, X_AB, {}, scratch);
  ASSERT_TRUE(found.has_value());
  expect_bounds(a, b, X_AB, *found, &scratch);
  EXPECT_NEAR(found->depth, 0.06, 1e-4);
  EXPECT_GT(found->direction.x(), 0.999);
  EXPECT_NEAR(found->least, 0.06, 1e-3);
  // The other way round too.
  const std::optional<Penetration> other = penetration(b, a, inverse(X_AB), {}, scratch);
  ASSERT_TRUE(other.has_value());
  EXPECT_NEAR(other->depth, 0.06, 1e-4);
}

TEST(Penetration, IsNotThatOfVerticesWithoutTriangles) {
  geometry::TriangleMesh stray = geometry::make_mesh(geometry::BoxShape{{0.02, 0.02, 0.02}});
  stray.vertices.insert(stray.vertices.begin(), {1.0, 0.0, 0.0});
  for (auto& triangle : stray.triangles) {
    for (std::uint32_t& index : triangle) ++index;
  }
  const TriangleTree a = tree_of(geometry::make_mesh(geometry::BoxShape{{0.3, 0.4, 0.5}}));
  const TriangleTree b = tree_of(stray);
  PenetrationScratch scratch;
  const Transform X_AB = transform_of(Pose::from_translation({-1.0, 0.0, 0.0}));
  ASSERT_TRUE(apart(a, b, X_AB));
  EXPECT_FALSE(penetration(a, b, X_AB, {}, scratch).has_value());
  EXPECT_FALSE(penetration(b, a, inverse(X_AB), {}, scratch).has_value());
}

// A body of two pieces, the lesser of which is inside of the other body while the greater is beside it.
TEST(Penetration, IsThatOfEachPiece) {
  const geometry::TriangleMesh box = geometry::make_mesh(geometry::BoxShape{{0.3, 0.4, 0.5}});
  const geometry::TriangleMesh crumb = geometry::make_mesh(geometry::BoxShape{{0.02, 0.02, 0.02}});
  const geometry::TriangleMesh sphere =
      geometry::transformed(geometry::make_mesh(geometry::Sphere{0.1}, 64), Pose::from_translation({0.5, 0.0, 0.0}));
  const TriangleTree a = tree_of(box);
  PenetrationScratch scratch;
  for (const TriangleTree& b : {tree_of(geometry::joined(crumb, sphere)), tree_of(geometry::joined(sphere, crumb))}) {
    core::RandomStream random(5, {});
    for (int i = 0; i < 20; ++i) {
      const double z = random.uniform(-0.2, 0.2), y = random.uniform(-0.15, 0.15), x = random.uniform(-0.1, 0.1);
      const Vector3d inside(x, y, z);
      const Transform X_AB = transform_of(Pose::from_translation(inside));
      ASSERT_FALSE(collide(a, b, X_AB, scratch.queries()));
      const std::optional<Penetration> found = penetration(a, b, X_AB, {}, scratch);
      ASSERT_TRUE(found.has_value());
      expect_bounds(a, b, X_AB, *found, &scratch);
      const Vector3d ways = Vector3d(0.16, 0.21, 0.26) - inside.cwiseAbs();
      EXPECT_GE(found->depth, ways.minCoeff() - 1e-6);
      EXPECT_TRUE(penetration(b, a, inverse(X_AB), {}, scratch).has_value());
    }
  }
}

TEST(Penetration, EndsForPoints) {
  PenetrationScratch scratch;
  for (const double x : {0.0, 56.0}) {
    const TriangleTree point = tree_of({{{x, 0.0, 0.0}}, {{0, 0, 0}}});
    const std::optional<Penetration> found = penetration(point, point, {}, {}, scratch);
    ASSERT_TRUE(found.has_value());
    EXPECT_LE(found->depth, 1e-5 * x + 1e-30);
    EXPECT_FALSE(collide(point, point, found->X_AB_apart, scratch.queries()));
  }
}

TEST(Penetration, HoldsItsBoundsForSolidsThatAreNotConvex) {
  const TriangleTree a = tree_of(tests::make_knot(0.1, 4000));
  const TriangleTree b = tree_of(tests::make_bumpy_sphere(0.05, 3000));
  PenetrationScratch scratch;
  tests::ContactConfigurations make(
      a.shared_mesh(), b.shared_mesh(),
      {[&](const Transform& X_AB) { return collide(a, b, X_AB, scratch.queries()); },
       [&](const Transform& X_AB) { return distance(a, b, X_AB, {}, scratch.queries())->distance; }},
      3);
  core::RandomStream random(4, {});
  int overlapping = 0;
  double sum_of_shares = 0.0;
  for (const Transform& X_AB : make.scattered(100)) {
    const std::optional<Penetration> found = penetration(a, b, X_AB, {}, scratch);
    EXPECT_EQ(found.has_value(), collide(a, b, X_AB, scratch.queries()));
    if (!found) continue;
    expect_bounds(a, b, X_AB, *found, &scratch);
    ++overlapping;
    sum_of_shares += found->least / found->depth;
    // Shorter translations leave them overlapping.
    for (int i = 0; i < 5; ++i) {
      const Vector3d by = 0.99 * found->least * direction_from(random);
      Transform X_moved = X_AB;
      for (std::size_t k = 0; k < 3; ++k) X_moved.translation[k] += static_cast<float>(by[static_cast<int>(k)]);
      EXPECT_TRUE(penetration(a, b, X_moved, {}, scratch).has_value());
    }
  }
  std::printf("%d overlapping knots and spheres: lower bound %.2f of the depth on average\n", overlapping,
              sum_of_shares / overlapping);
  EXPECT_GT(overlapping, 20);
}

TEST(Penetration, DoesNotAllocateOnceWarm) {
  if (!tests::can_count_allocations()) GTEST_SKIP() << "allocations cannot be counted in this build";
  const TriangleTree a = tree_of(geometry::make_mesh(geometry::Sphere{0.1}, 64));
  const TriangleTree b = tree_of(geometry::make_mesh(geometry::Cylinder{0.05, 0.2}, 64));
  PenetrationScratch scratch;
  Transform X_AB;
  X_AB.translation = {0.12F, 0.01F, 0.02F};
  for (const bool warm : {false, true}) {
    const std::uint64_t before = tests::allocation_count();
    EXPECT_TRUE(penetration(a, b, X_AB, {}, scratch).has_value());
    EXPECT_TRUE(!warm || tests::allocation_count() == before);
  }
}

}  // namespace
}  // namespace prescene::collision::penetration_laws_test
