// SPDX-License-Identifier: Apache-2.0
// Meshes in contact: fixed surfaces of triangles, hulls, given convex parts, and decompositions of hollow things.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "bullet_scenes.h"
#include "prescene/geometry/mesh_facts.h"
#include "prescene/geometry/triangle_mesh.h"
#include "prescene/simulation/convex_polytope.h"

namespace prescene::tests {
namespace {

using belief::MeshUse;
using geometry::BoxShape;
using geometry::TriangleMesh;

belief::MeshShape mesh_shape(const TriangleMesh& mesh, MeshUse use) {
  return {std::make_shared<const TriangleMesh>(mesh), Pose{}, use};
}

/// A square of `edge` at z = 0 in 2 n^2 triangles, seen from above.
TriangleMesh grid(double edge, int n) {
  TriangleMesh mesh;
  for (int y = 0; y <= n; ++y) {
    for (int x = 0; x <= n; ++x)
      mesh.vertices.emplace_back(edge * (double(x) / n - 0.5), edge * (double(y) / n - 0.5), 0.0);
  }
  const auto at = [&](int x, int y) { return static_cast<std::uint32_t>(y * (n + 1) + x); };
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) {
      mesh.triangles.push_back({at(x, y), at(x + 1, y), at(x + 1, y + 1)});
      mesh.triangles.push_back({at(x, y), at(x + 1, y + 1), at(x, y + 1)});
    }
  }
  return mesh;
}

TriangleMesh box_at(const Vector3d& size, const Vector3d& center) {
  return geometry::transformed(geometry::make_mesh(BoxShape{size}), Pose::from_translation(center));
}

TEST(Meshes, SeamsOfASurfaceAreNotFelt) {
  // Slides as on a plane, over some hundred edges of triangles.
  for (const double heading : {0.0, 0.3, 0.7854}) {
    Scene scene;
    scene.name = "grid";
    scene.supports.push_back(support_of("grid", {mesh_shape(grid(2.0, 100), MeshUse::kSurface)}, Pose{}));
    ObjectModel block = primitive_model("block", BoxShape{{0.1, 0.1, 0.04}});
    block.contact.friction = belief::FixedScalar{0.25};
    add_object(scene, block, "block");
    auto instance = instance_of(scene);
    WorldState start = start_of(scene);
    start.objects[0].X_WO.translation = {0.0, 0.0, 0.02};
    start.objects[0].V_WO.linear = {std::cos(heading), std::sin(heading), 0.0};
    instance->set_state(start);
    step_for(*instance, 1.0);
    const belief::ObjectState end = instance->state().objects[0];
    EXPECT_NEAR(end.X_WO.translation.head<2>().norm(), 1.0 / (2.0 * 0.25 * kG), 3e-3) << heading;
    EXPECT_NEAR(std::atan2(end.X_WO.translation.y(), end.X_WO.translation.x()), heading, 2e-3);
    EXPECT_NEAR(end.X_WO.translation.z(), 0.02, 1e-4);
    EXPECT_NEAR((end.X_WO.rotation * Vector3d::UnitZ()).z(), 1.0, 1e-6);
  }
}

TEST(Meshes, BallRollsStraightOverSeams) {
  Scene scene;
  scene.name = "grid";
  scene.supports.push_back(support_of("grid", {mesh_shape(grid(2.0, 100), MeshUse::kSurface)}, Pose{}));
  add_object(scene, primitive_model("ball", geometry::Sphere{0.02}), "ball");
  auto instance = instance_of(scene);
  WorldState start = start_of(scene);
  start.objects[0].X_WO.translation = {-0.5, 0.013, 0.02};
  start.objects[0].V_WO.linear = {1.0, 0.0, 0.0};
  start.objects[0].V_WO.angular = {0.0, 50.0, 0.0};
  instance->set_state(start);
  step_for(*instance, 1.0);
  const belief::ObjectState end = instance->state().objects[0];
  EXPECT_NEAR(end.X_WO.translation.x(), 0.5, 2e-3);
  EXPECT_NEAR(end.X_WO.translation.y(), 0.013, 1e-3);
  EXPECT_NEAR(end.X_WO.translation.z(), 0.02, 1e-4);
}

TEST(Meshes, AHullCoversItsHollowAndTheOtherUsesKeepIt) {
  // A tray, let go above a post that fits between its walls: open side down, its floor comes to lie on the post; as a
  // hull it stops with its rim on it.
  const Vector3d inner(0.2, 0.2, 0.08);
  const double wall = 0.01;
  TriangleMesh parts = box_at({0.22, 0.22, wall}, {0.0, 0.0, 0.5 * wall});
  for (const double side : {-1.0, 1.0}) {
    parts = geometry::joined(parts, box_at({wall, 0.22, 0.08}, {side * 0.105, 0.0, wall + 0.04}));
    parts = geometry::joined(parts, box_at({0.2, wall, 0.08}, {0.0, side * 0.105, wall + 0.04}));
  }
  const TriangleMesh tray = geometry::make_open_bin(inner, wall);
  const double post = 0.15;
  struct Case {
    const char* name;
    belief::MeshShape shape;
    double z;  // of the tray's outer bottom face at rest
  };
  for (const Case& c : {Case{"hull", mesh_shape(tray, MeshUse::kConvexHull), post + 0.09},
                        Case{"decomposition", mesh_shape(tray, MeshUse::kDecompose), post + wall},
                        Case{"parts", mesh_shape(parts, MeshUse::kConvexParts), post + wall}}) {
    ObjectModel model;
    model.name = "tray";
    model.collision = {c.shape};
    model.mass = belief::FixedScalar{0.5};
    model.center_of_mass = belief::Vector3Distribution::fixed({0.0, 0.0, 0.03});
    model.unit_inertia = Vector3d(0.006, 0.006, 0.01).asDiagonal();
    model.contact.friction = belief::FixedScalar{0.5};
    model.contact.restitution = belief::FixedScalar{0.0};
    Scene scene;
    scene.name = "tray";
    scene.supports.push_back(floor_support());
    scene.supports.push_back(support_of("post", {belief::PrimitiveShape{BoxShape{{0.1, 0.1, post}}, Pose{}}},
                                        Pose::from_translation({0.0, 0.0, 0.5 * post})));
    add_object(scene, model, "tray");
    auto instance = instance_of(scene);
    WorldState start = start_of(scene);
    start.objects[0].X_WO = Pose{about(Vector3d::UnitX(), kPi), {0.0, 0.0, c.z + 0.005}};
    instance->set_state(start);
    step_for(*instance, 1.0);
    const belief::ObjectState end = instance->state().objects[0];
    EXPECT_NEAR(end.X_WO.translation.z(), c.z, 2e-3) << c.name;
    EXPECT_LT(end.V_WO.linear.norm(), 1e-3) << c.name;
  }
}

TEST(Meshes, DecompositionsCoverTheSurfaceAndFillNoHollow) {
  struct Case {
    const char* name;
    TriangleMesh mesh;
    std::vector<Vector3d> hollow;  // points of it
  };
  // A bin, a cup turned from a profile that goes up outside and down inside, and a clamp: two bars on a third.
  const TriangleMesh clamp = geometry::joined(
      box_at({0.1, 0.02, 0.02}, {0, 0, 0.01}),
      geometry::joined(box_at({0.02, 0.02, 0.1}, {-0.04, 0, 0.0701}), box_at({0.02, 0.02, 0.1}, {0.04, 0, 0.0701})));
  const TriangleMesh cup =
      geometry::make_lathe({{0.0, 0.0}, {0.04, 0.0}, {0.04, 0.1}, {0.037, 0.1}, {0.037, 0.004}, {0.0, 0.004}});
  for (const Case& c :
       {Case{"bin", geometry::make_open_bin({0.2, 0.2, 0.08}, 0.01), {{0, 0, 0.03}, {0.08, -0.08, 0.08}}},
        Case{"cup", cup, {{0, 0, 0.02}, {0.025, 0, 0.05}, {0, -0.02, 0.095}}},
        Case{"clamp", clamp, {{0, 0, 0.05}, {0.02, 0, 0.1}}}}) {
    const auto parts = simulation::hacd_decomposer()(c.mesh, {});
    ASSERT_TRUE(parts.ok()) << c.name;
    const double diagonal = geometry::bounding_box(c.mesh).sizes().norm();
    // Signed distance to the nearest part's planes, negative inside.
    const auto depth = [&](const Vector3d& p) {
      double least = std::numeric_limits<double>::infinity();
      for (const TriangleMesh& part : *parts) {
        const auto polytope = simulation::make_polytope(part.vertices);
        double out = -std::numeric_limits<double>::infinity();
        for (const auto& face : polytope->faces) out = std::max(out, face.normal.dot(p) - face.offset);
        least = std::min(least, out);
      }
      return least;
    };
    for (const Vector3d& p : c.hollow) EXPECT_GT(depth(p), 0.0) << c.name << " at " << p.transpose();
    for (const auto& point : geometry::sample_surface(c.mesh, 200, 1)) {
      EXPECT_LT(depth(point.position), 0.02 * diagonal) << c.name << " at " << point.position.transpose();
    }
  }
}

TEST(Meshes, AHollowThingThatMovesCarriesWhatLiesInIt) {
  ObjectModel tray =
      model_of("tray", {mesh_shape(geometry::make_open_bin({0.2, 0.2, 0.08}, 0.01), MeshUse::kDecompose)});
  tray.contact.friction = belief::FixedScalar{0.3};
  Scene scene = floor_scene(tray);
  add_object(scene, primitive_model("ball", geometry::Sphere{0.02}, 0.05), "ball");
  auto instance = instance_of(scene);
  WorldState start = start_of(scene);
  start.objects[0].V_WO.linear = {1.5, 0.4, 0.0};
  start.objects[1].X_WO.translation = {0.02, 0.01, 0.035};
  instance->set_state(start);
  step_for(*instance, 2.0);
  const WorldState end = instance->state();
  const Vector3d ball = end.objects[0].X_WO.inverse() * end.objects[1].X_WO.translation;
  EXPECT_GT(end.objects[0].X_WO.translation.x(), 0.2);
  EXPECT_LT(std::abs(ball.x()), 0.1);
  EXPECT_LT(std::abs(ball.y()), 0.1);
  EXPECT_NEAR(ball.z(), 0.03, 2e-3);
}

TEST(Meshes, AHollowThingFallsOntoTrianglesAndRests) {
  // Two kinds of concave shapes on each other: a moving tray in a fixed bin of triangles.
  Scene scene;
  scene.name = "bin";
  scene.supports.push_back(floor_support());
  scene.supports.push_back(
      support_of("bin", {mesh_shape(geometry::make_open_bin({0.5, 0.5, 0.2}, 0.01), MeshUse::kSurface)}, Pose{}));
  add_object(scene,
             model_of("tray", {mesh_shape(geometry::make_open_bin({0.2, 0.2, 0.08}, 0.01), MeshUse::kDecompose)}),
             "tray");
  WorldState start = start_of(scene);
  start.objects[0].X_WO = Pose{about({1.0, 0.3, 0.0}, 0.4), {0.05, -0.02, 0.2}};
  simulation::RunRequest request;
  const belief::Trajectory run = run_one(*simulator_of(scene), start, request);
  EXPECT_EQ(run.end, belief::TrajectoryEnd::kAtRest);
  EXPECT_NEAR(run.final().objects[0].X_WO.translation.z(), 0.01, 1e-3);
  EXPECT_NEAR((run.final().objects[0].X_WO.rotation * Vector3d::UnitZ()).z(), 1.0, 1e-3);
}

TEST(Meshes, AnotherSimulatorOfTheSameMeshesMakesNothing) {
  // While something moves, one is made in every frame: what is made of meshes must not be made again.
  Scene scene;
  scene.supports.push_back(support_of("scan", {mesh_shape(grid(2.0, 100), MeshUse::kSurface)}, Pose{}));
  add_object(scene, model_of("box", {mesh_shape(box_at({0.1, 0.1, 0.1}, Vector3d::Zero()), MeshUse::kConvexHull)}),
             "box");
  add_object(scene, model_of("tray", {mesh_shape(geometry::make_open_bin({0.2, 0.2, 0.08}, 0.01), MeshUse::kSpheres)}),
             "tray");
  simulation::ShapeStore shapes;
  ASSERT_TRUE(simulation::make_bullet_simulator(scene, shapes).ok());
  // The triangles and their trees; the hull and its core; the spheres.
  EXPECT_EQ(shapes.built(), 5U);
  const std::size_t facts = geometry::mesh_facts_made();
  scene.objects[0].name = "another";
  scene.supports[0].X_WS.translation.z() = 0.1;
  ASSERT_TRUE(simulation::make_bullet_simulator(scene, shapes).ok());
  EXPECT_EQ(shapes.built(), 5U);
  EXPECT_EQ(geometry::mesh_facts_made(), facts);
}

TEST(Meshes, WhatCannotBeSimulatedIsNamed) {
  simulation::ShapeStore shapes(simulation::hacd_decomposer());
  const auto status_of = [&](const belief::MeshShape& shape) {
    ObjectModel model = primitive_model("thing", geometry::Sphere{0.05});
    model.collision = {shape};
    return simulation::make_bullet_simulator(floor_scene(model), shapes).status();
  };
  const core::Status surface = status_of(mesh_shape(geometry::make_mesh(BoxShape{{0.1, 0.1, 0.1}}), MeshUse::kSurface));
  EXPECT_EQ(surface.code(), core::StatusCode::kUnsupported);
  EXPECT_THAT(surface.message(), testing::HasSubstr("object"));
  for (const MeshUse use : {MeshUse::kConvexHull, MeshUse::kConvexParts, MeshUse::kDecompose, MeshUse::kSpheres}) {
    const core::Status flat = status_of(mesh_shape(grid(0.1, 2), use));
    EXPECT_EQ(flat.code(), core::StatusCode::kInvalidInput) << static_cast<int>(use);
    EXPECT_FALSE(flat.message().empty());
    EXPECT_EQ(status_of(mesh_shape(TriangleMesh{}, use)).code(), core::StatusCode::kInvalidInput);
  }
}

}  // namespace
}  // namespace prescene::tests
