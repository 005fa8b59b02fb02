// SPDX-License-Identifier: Apache-2.0
// Bodies of spheres in the lockstep stepper, against the closed forms that hold for exact shapes and against what
// nothing may do: gain energy, sink in, or pass through a wall.
#include <gtest/gtest.h>

#include "lockstep_scenes.h"
#include "prescene/geometry/sampling.h"
#include "tests/support/closed_forms.h"
#include "tests/support/hollow_meshes.h"

namespace prescene::tests::hollow_bodies_test {
namespace {

using belief::PrimitiveShape;
using geometry::BoxShape;
using geometry::Cylinder;
using geometry::TriangleMesh;

ObjectModel hollow_model(const std::string& name, const TriangleMesh& mesh, double mass = 1.0,
                         const belief::SphereSettings& settings = {}) {
  return model_of(name, {spheres_of(mesh, settings)}, mass);
}

TEST(HollowBodies, RestAtTheirTrueHeight) {
  struct Case {
    const char* name;
    TriangleMesh mesh;
    double height;
  };
  for (const Case& c :
       {Case{"box", geometry::make_mesh(BoxShape{{0.1, 0.06, 0.04}}), 0.02},
        Case{"cylinder", geometry::make_mesh(Cylinder{0.03, 0.1}, 64), 0.05},
        Case{"carton", geometry::make_gable_carton(0.07, 0.07, 0.15, 0.2), 0.1},
        Case{"bin", geometry::make_open_bin({0.2, 0.15, 0.1}, 0.004), 0.0}, Case{"cup", cup(0.04, 0.09, 0.003), 0.0}}) {
    const Scene scene = floor_scene(hollow_model("thing", c.mesh));
    auto instance = lockstep_instance_of(scene);
    WorldState start = start_of(scene);
    start.objects[0].X_WO.translation = {0.3, 0.1, c.height + 0.01};
    instance->set_state(start);
    step_for(*instance, 2.0);
    const belief::ObjectState end = instance->state().objects[0];
    EXPECT_NEAR(end.X_WO.translation.z(), c.height, 1e-4) << c.name;
    EXPECT_NEAR((end.X_WO.rotation * Vector3d::UnitZ()).z(), 1.0, 1e-6) << c.name;
    EXPECT_LT(end.V_WO.linear.norm(), 1e-4) << c.name;
  }
}

TEST(HollowBodies, SlideOnAnInclineIffTanThetaExceedsMu) {
  const ObjectModel block = hollow_model("block", geometry::make_mesh(BoxShape{{0.1, 0.1, 0.04}}));
  const double angle = 20.0 * kPi / 180.0;
  const auto slide = [&](double mu) {
    const Scene scene = incline_scene(block, 0.02, angle, mu);
    return slide_for_a_second(*lockstep_instance_of(scene), scene).moved;
  };
  EXPECT_LT(slide(std::tan(angle) + 5e-4), 5e-5);
  EXPECT_GT(slide(std::tan(angle) - 5e-4), 1e-3);
}

TEST(HollowBodies, TipOverTheirDiagonal) {
  const Scene scene =
      floor_scene(hollow_model("box", geometry::make_mesh(BoxShape{{0.1, 0.08, 0.1}}), 1.0, {3000, 1e-3}));
  expect_tipping_at_the_diagonal(*lockstep_instance_of(scene), scene, 0.1, 0.1, 0.1, 0.5);
}

TEST(HollowBodies, StacksOfThreeStayForTenSeconds) {
  Scene scene;
  scene.name = "stack";
  scene.supports.push_back(floor_support());
  for (int i = 0; i < 3; ++i) {
    const std::string name = "box" + std::to_string(i);
    add_object(scene,
               i == 1 ? primitive_model(name, BoxShape{{0.1, 0.1, 0.1}})
                      : hollow_model(name, geometry::make_mesh(BoxShape{{0.1, 0.1, 0.1}})),
               name);
  }
  expect_stack_stays(*lockstep_instance_of(scene), scene, 2e-5, 1e-4);
}

TEST(HollowBodies, RollDownAnIncline) {
  const double angle = 15.0 * kPi / 180.0;
  Scene scene;
  scene.name = "incline";
  const Quaterniond tilt = about(Vector3d::UnitY(), angle);
  scene.supports.push_back(support_of("plank", {PrimitiveShape{BoxShape{{10.0, 2.0, 0.1}}, Pose{}}},
                                      Pose{tilt, tilt * Vector3d(0.0, 0.0, -0.05)}));
  ObjectModel model = hollow_model("ball", geometry::make_mesh(geometry::Sphere{0.04}, 64));
  model.contact.friction = belief::FixedScalar{0.8};
  add_object(scene, model, "ball");
  auto instance = lockstep_instance_of(scene);
  WorldState start = start_of(scene);
  start.objects[0].X_WO = Pose{tilt, tilt * Vector3d(0.0, 0.0, 0.04)};
  instance->set_state(start);
  step_for(*instance, 1.0);
  const belief::ObjectState end = instance->state().objects[0];
  const double speed = 5.0 / 7.0 * kG * std::sin(angle);
  EXPECT_NEAR(end.V_WO.linear.norm(), speed, 0.01 * speed);
  EXPECT_NEAR(end.V_WO.angular.norm(), speed / 0.04, 0.01 * speed / 0.04);
}

TEST(HollowBodies, DoNotPassThroughThinWalls) {
  const TriangleMesh wall = geometry::make_mesh(BoxShape{{0.002, 1.0, 1.0}});
  core::RandomStream stream(3, core::Purpose::kTest);
  for (const belief::CollisionShape& shape :
       {belief::CollisionShape(spheres_of(wall, {5000, 5e-4})),
        belief::CollisionShape(PrimitiveShape{BoxShape{{0.002, 1.0, 1.0}}, Pose{}})}) {
    Scene scene;
    scene.name = "wall";
    scene.supports.push_back(support_of("wall", {shape}, Pose{}));
    add_object(scene, hollow_model("cup", cup(0.02, 0.04, 0.002)), "cup");
    auto instance = lockstep_instance_of(scene);
    for (int i = 0; i < 20; ++i) {
      WorldState start = start_of(scene);
      start.objects[0].X_WO = Pose{geometry::uniform_rotation(stream), {-0.3, 0.0, 0.1}};
      start.objects[0].V_WO.linear = Vector3d(20.0, 0.0, 0.0) + 3.0 * geometry::normal_vector(stream);
      start.objects[0].V_WO.angular = 10.0 * geometry::normal_vector(stream);
      instance->set_state(start);
      step_for(*instance, 0.05);
      EXPECT_LT(instance->state().objects[0].X_WO.translation.x(), 0.0) << shape.index() << " " << i;
    }
  }
}

/// Of all objects together, J.
double energy(const Scene& scene, const WorldState& state) {
  double sum = 0.0;
  for (std::size_t i = 0; i < state.objects.size(); ++i) {
    const belief::ObjectState& object = state.objects[i];
    const geometry::Matrix3d R = object.X_WO.rotation.toRotationMatrix();
    const Vector3d w = R.transpose() * object.V_WO.angular;
    const Vector3d arm = R * object.physical.center_of_mass;
    const Vector3d v = object.V_WO.linear + object.V_WO.angular.cross(arm);
    const auto& inertia = scene.model_of(scene.objects[i]).unit_inertia;
    sum += object.physical.mass *
           (0.5 * v.squaredNorm() + 0.5 * w.dot(inertia * w) + kG * (object.X_WO.translation + arm).z());
  }
  return sum;
}

TEST(HollowBodies, DropIntoEachOtherWithoutGainingEnergyOrSinkingIn) {
  Scene scene = floor_scene(hollow_model("mug", mug(), 0.3, {1500, 0.0}));
  add_object(scene, primitive_model("ball", geometry::Sphere{0.015}, 0.05), "ball");
  add_object(scene, hollow_model("cup", cup(0.02, 0.05, 0.002), 0.05, {1000, 0.0}), "cup");
  core::RandomStream stream(9, core::Purpose::kTest);
  std::vector<WorldState> starts;
  for (int i = 0; i < 24; ++i) {
    WorldState start = start_of(scene);
    start.objects[0].X_WO.translation = {0.0, 0.0, 0.0005};
    start.objects[1].X_WO.translation = {stream.uniform(-0.02, 0.02), stream.uniform(-0.02, 0.02), 0.15};
    start.objects[2].X_WO =
        Pose{geometry::uniform_rotation(stream), {stream.uniform(-0.03, 0.03), stream.uniform(-0.03, 0.03), 0.25}};
    starts.push_back(start);
  }
  simulation::RunRequest request;
  request.stop.duration = 1.5;
  request.stop.stop_at_rest = false;
  request.sample_interval = 1.0 / 240.0;
  const auto runs = run_all(*lockstep_of(scene), starts, request);
  int inside = 0;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    ASSERT_NE(runs[i].end, belief::TrajectoryEnd::kDiverged) << i;
    const double begun = energy(scene, runs[i].start());
    for (const WorldState& state : runs[i].states) {
      ASSERT_LT(energy(scene, state), 1.005 * begun) << i << " at " << state.time;
      ASSERT_GT(state.objects[1].X_WO.translation.z(), 0.015 - 2e-3) << i << " at " << state.time;
    }
    // A ball in the mug is within its walls of 3 mm and over its bottom.
    const Vector3d ball = runs[i].final().objects[0].X_WO.inverse() * runs[i].final().objects[1].X_WO.translation;
    if (ball.head<2>().norm() > 0.037 || ball.z() < 0.0 || ball.z() > 0.09) continue;
    ++inside;
    EXPECT_LT(ball.head<2>().norm(), 0.037 - 0.015 + 1e-3) << i;
    EXPECT_GT(ball.z(), 0.003 + 0.015 - 1.5e-3) << i;
  }
  EXPECT_GT(inside, 14);
}

}  // namespace
}  // namespace prescene::tests::hollow_bodies_test
