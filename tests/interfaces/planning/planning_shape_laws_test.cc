// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/planning/planning_shape.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "prescene/collision/point_queries.h"
#include "prescene/collision/spheres/sphere_packing.h"
#include "prescene/core/check.h"
#include "prescene/core/random.h"
#include "tests/support/brute_force.h"
#include "tests/support/collision_meshes.h"

namespace prescene::interfaces::planning_shape_laws_test {
namespace {

using geometry::Pose;
using geometry::Vector3d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

PlanningShape shape_of(const geometry::TriangleMesh& mesh) {
  core::ThreadPool pool(1);
  auto shape = PlanningShape::of_mesh(mesh, "mesh", pool);
  PRESCENE_CHECK(shape.ok());
  return *std::move(shape);
}

PlanningShape shape_of(const geometry::Primitive& primitive) {
  core::ThreadPool pool(1);
  auto shape = PlanningShape::of_primitive(primitive, "primitive", pool);
  PRESCENE_CHECK(shape.ok());
  return *std::move(shape);
}

Pose random_pose(core::RandomStream& random, double reach) {
  const double turn_z = random.normal(), turn_y = random.normal(), turn_x = random.normal();
  const Vector3d turn(turn_x, turn_y, turn_z);
  const double z = random.uniform() - 0.5, y = random.uniform() - 0.5, x = random.uniform() - 0.5;
  return {geometry::exp_rotation(turn), reach * Vector3d(x, y, z)};
}

/// Points of the surfaces of primitives of radius 0.1 m and length 0.3 m, at an angle about z and a share of the rest.
std::vector<Vector3d> surface_points(const geometry::Primitive& primitive) {
  std::vector<Vector3d> points;
  for (int i = 0; i < 360; ++i) {
    for (int k = 0; k <= 40; ++k) {
      const double angle = i * std::numbers::pi / 180.0, share = k / 40.0;
      double radius = 0.1, z = 0.3 * (share - 0.5);
      if (std::holds_alternative<geometry::Cone>(primitive)) radius *= 1.0 - share;
      if (std::holds_alternative<geometry::Sphere>(primitive) || std::holds_alternative<geometry::Capsule>(primitive)) {
        const double up = std::numbers::pi * (share - 0.5);
        const double middle = std::holds_alternative<geometry::Sphere>(primitive) ? 0.0 : std::copysign(0.15, up);
        radius = 0.1 * std::cos(up);
        z = middle + 0.1 * std::sin(up);
      }
      points.emplace_back(radius * std::cos(angle), radius * std::sin(angle), z);
    }
  }
  return points;
}

TEST(PlanningShapeLaws, PolyhedraContainTheirPrimitives) {
  for (const geometry::Primitive& primitive :
       {geometry::Primitive(geometry::Sphere{0.1}), geometry::Primitive(geometry::Cylinder{0.1, 0.3}),
        geometry::Primitive(geometry::Capsule{0.1, 0.3}), geometry::Primitive(geometry::Cone{0.1, 0.3})}) {
    const PlanningShape shape = shape_of(primitive);
    EXPECT_TRUE(shape.is_solid());
    for (const Vector3d& p : surface_points(primitive)) {
      // A little inside, as single precision rounds the corners.
      ASSERT_NE(collision::winding_number(*shape.triangles(), (1.0 - 1e-6) * p), 0) << p.transpose();
      const auto nearest = collision::nearest_point(*shape.triangles(), p);
      ASSERT_LE(nearest->distance, 0.0025 * 0.1);
    }
  }
}

TEST(PlanningShapeLaws, GapsAreThoseOfBruteForce) {
  const auto mesh_a = tests::make_bumpy_sphere(0.1, 200), mesh_b = tests::make_knot(0.1, 200);
  const PlanningShape a = shape_of(mesh_a), b = shape_of(mesh_b);
  core::RandomStream random(7, core::Purpose::kTest);
  ShapeScratch scratch;
  int apart = 0;
  for (int i = 0; i < 20; ++i) {
    const Pose X_AB = random_pose(random, 0.8);
    const double expected = tests::distance_by_brute_force(a.triangles()->mesh(), b.triangles()->mesh(),
                                                           *collision::to_transform(X_AB), 2.0);
    const double gap = shape_gap(a, b, X_AB, kInfinity, scratch);
    apart += expected > 0.0;
    ASSERT_LE(gap, expected + 1e-12);
    ASSERT_GE(gap, expected - 1e-5);
    // With a limit, and as a yes or no.
    if (gap > 0.0) {
      ASSERT_EQ(shape_gap(a, b, X_AB, 0.5 * gap, scratch), kInfinity);
    }
    ASSERT_EQ(shape_gap(a, b, X_AB, 2.0 * gap + 0.01, scratch), gap);
    ASSERT_TRUE(shapes_meet(a, b, X_AB, expected + 1e-6, scratch));
    if (expected > 1e-5 && collision::winding_number(*a.triangles(), X_AB.translation) == 0) {
      ASSERT_FALSE(shapes_meet(a, b, X_AB, expected - 1e-6, scratch));
    }
  }
  EXPECT_GT(apart, 10);
}

TEST(PlanningShapeLaws, WhatIsInsideASolidMeetsIt) {
  const PlanningShape room = shape_of(geometry::Primitive(geometry::BoxShape{{1.0, 1.0, 1.0}}));
  const PlanningShape die = shape_of(geometry::Primitive(geometry::BoxShape{{0.02, 0.02, 0.02}}));
  ShapeScratch scratch;
  const Pose X = Pose::from_translation({0.11, -0.2, 0.3});
  EXPECT_TRUE(shapes_meet(room, die, X, 0.0, scratch));
  EXPECT_TRUE(shapes_meet(die, room, X.inverse(), 0.0, scratch));
  EXPECT_GT(shape_gap(room, die, X, kInfinity, scratch), 0.1);
  // A box without a lid encloses nothing.
  auto open = geometry::make_mesh(geometry::BoxShape{{1.0, 1.0, 1.0}});
  open.triangles.pop_back();
  EXPECT_FALSE(shape_of(open).is_solid());
  EXPECT_FALSE(shapes_meet(shape_of(open), die, X, 0.0, scratch));
}

TEST(PlanningShapeLaws, SpheresMeetTrianglesAndSpheres) {
  core::ThreadPool pool(1);
  const auto mesh = tests::collision_mesh(geometry::make_mesh(geometry::Sphere{0.1}), "ball");
  collision::PackingOptions packing;
  packing.max_spheres = 50;
  const auto packed = collision::pack_spheres(*mesh, packing, pool);
  ASSERT_TRUE(packed.ok());
  const PlanningShape ball = PlanningShape::of_spheres(*collision::SphereTree::make(packed->packing, {}, pool));
  const PlanningShape box = shape_of(geometry::Primitive(geometry::BoxShape{{0.2, 0.2, 0.2}}));
  ShapeScratch scratch;
  // The packing is inside of the ball by little at its poles.
  const Pose near = Pose::from_translation({0.25, 0.0, 0.0});
  EXPECT_NEAR(shape_gap(box, ball, near, kInfinity, scratch), 0.05, 0.01);
  EXPECT_EQ(shape_gap(ball, box, near.inverse(), kInfinity, scratch), shape_gap(box, ball, near, kInfinity, scratch));
  EXPECT_EQ(shape_gap(box, ball, near, 0.01, scratch), kInfinity);
  EXPECT_FALSE(shapes_meet(box, ball, near, 0.03, scratch));
  EXPECT_TRUE(shapes_meet(box, ball, near, 0.07, scratch));
  EXPECT_NEAR(shape_gap(ball, ball, near, kInfinity, scratch), 0.05, 0.02);
  EXPECT_TRUE(shapes_meet(box, ball, Pose::identity(), 0.0, scratch));
}

TEST(PlanningShapeLaws, WhatIsNotFiniteMeetsEverything) {
  const PlanningShape die = shape_of(geometry::Primitive(geometry::BoxShape{{0.02, 0.02, 0.02}}));
  ShapeScratch scratch;
  const Pose nowhere = Pose::from_translation({std::nan(""), 0.0, 0.0});
  EXPECT_TRUE(shapes_meet(die, die, nowhere, 0.0, scratch));
  EXPECT_EQ(shape_gap(die, die, nowhere, kInfinity, scratch), 0.0);
  core::ThreadPool pool(1);
  EXPECT_EQ(PlanningShape::of_shapes({}, "nothing", pool).status().code(), core::StatusCode::kInvalidInput);
}

}  // namespace
}  // namespace prescene::interfaces::planning_shape_laws_test
