// SPDX-License-Identifier: Apache-2.0
// What is said to bear does: set down on a floor by it, bodies of spheres touch; and it is hardly less than the body.
#include "prescene/simulation/outcomes/bearing_body.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "prescene/geometry/primitives.h"
#include "prescene/geometry/sampling.h"
#include "prescene/simulation/bullet/bullet_simulator.h"
#include "tests/support/simple_scenes.h"

namespace prescene::simulation {
namespace {

using geometry::Pose;

belief::CollisionShape spheres_of(const geometry::TriangleMesh& mesh, int count, double edge_fidelity) {
  belief::MeshShape shape;
  shape.mesh = std::make_shared<const geometry::TriangleMesh>(mesh);
  shape.use = belief::MeshUse::kSpheres;
  shape.spheres = {count, edge_fidelity};
  return shape;
}

ConvexPolytope hull_of(const std::vector<belief::CollisionShape>& shapes) {
  return *make_polytope(belief::collision_mesh(shapes).vertices);
}

TEST(BearingBody, OfABoxIsHardlySmallerThanTheBox) {
  ShapeStore store;
  const std::vector<belief::CollisionShape> shapes = {
      spheres_of(geometry::make_mesh(geometry::BoxShape{{0.10, 0.08, 0.06}}), 1000, 0.001)};
  const auto body = bearing_body(shapes, hull_of(shapes), Vector3d(0.0, 0.0, -0.01), store);
  ASSERT_TRUE(body);
  EXPECT_NEAR(body->inner_radius, 0.02 - 1e-3, 1e-6);
  ASSERT_EQ(body->polytope.faces.size(), 6U);
  for (const ConvexPolytope::Face& face : body->polytope.faces) {
    const double whole = face.normal.cwiseAbs().dot(Vector3d(0.05, 0.04, 0.03));
    EXPECT_LT(face.offset, whole);
    EXPECT_GT(face.offset, whole - 0.5e-3);
  }
}

TEST(BearingBody, OfSpheresTooFewIsNotKnown) {
  ShapeStore store;
  const std::vector<belief::CollisionShape> shapes = {
      spheres_of(geometry::make_mesh(geometry::BoxShape{{0.4, 0.4, 0.4}}), 50, 0.03)};
  EXPECT_FALSE(bearing_body(shapes, hull_of(shapes), Vector3d::Zero(), store));
}

TEST(BearingBody, OfAHollowHasNoBallAboutItsMiddle) {
  ShapeStore store;
  const std::vector<belief::CollisionShape> shapes = {spheres_of(
      geometry::make_lathe({{0.0, 0.0}, {0.04, 0.0}, {0.04, 0.09}, {0.036, 0.09}, {0.036, 0.005}, {0.0, 0.005}}), 1000,
      0.001)};
  const auto body = bearing_body(shapes, hull_of(shapes), Vector3d(0.0, 0.0, 0.04), store);
  ASSERT_TRUE(body);
  EXPECT_EQ(body->inner_radius, 0.0);
}

TEST(BearingBody, IsWhatTheSimulatorHasTouchTheFloor) {
  const std::vector<belief::CollisionShape> bodies[] = {
      {spheres_of(geometry::make_mesh(geometry::BoxShape{{0.10, 0.08, 0.06}}), 800, 0.001)},
      {spheres_of(
           geometry::make_lathe({{0.0, 0.0}, {0.03, 0.0}, {0.04, 0.09}, {0.036, 0.09}, {0.027, 0.005}, {0.0, 0.005}}),
           800, 0.0),
       belief::PrimitiveShape{geometry::BoxShape{{0.02, 0.01, 0.04}}, Pose::from_translation({0.05, 0.0, 0.05})}},
  };
  core::ThreadPool pool(1);
  for (const std::vector<belief::CollisionShape>& shapes : bodies) {
    ShapeStore store;
    const ConvexPolytope hull = hull_of(shapes);
    const auto body = bearing_body(shapes, hull, Vector3d::Zero(), store);
    ASSERT_TRUE(body);
    belief::Scene scene = tests::floor_scene(tests::model_of("body", shapes));
    const auto simulator = *make_bullet_simulator(scene, store);
    RunRequest request;
    request.stop.duration = simulator->step_size();
    core::RandomStream stream(5, core::Purpose::kTest);
    int without = 0;
    for (int i = 0; i < 400; ++i) {
      belief::WorldState state = belief::mean_start(scene);
      Pose& X_WO = state.objects[0].X_WO;
      X_WO.rotation = geometry::uniform_rotation(stream);
      const auto lowest = [&](const ConvexPolytope& polytope) {
        double least = std::numeric_limits<double>::infinity();
        for (const Vector3d& v : polytope.vertices) least = std::min(least, (X_WO.rotation * v).z());
        return least;
      };
      const auto touches_at = [&](double height) {
        X_WO.translation = {0.0, 0.0, height};
        std::vector<belief::Trajectory> runs(1);
        simulator->run({&state, 1}, request, stream, 0, pool, runs);
        return !runs[0].contacts.empty();
      };
      without += touches_at(-lowest(body->polytope) - 1e-4) ? 0 : 1;
      EXPECT_FALSE(touches_at(-lowest(hull) + body->rise + 1e-3));
    }
    EXPECT_EQ(without, 0);
  }
}

}  // namespace
}  // namespace prescene::simulation
