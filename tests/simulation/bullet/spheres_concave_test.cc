// SPDX-License-Identifier: Apache-2.0
// Hollow things of spheres in, on and through each other: they stay where they should, come to rest, and pass through
// nothing.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bullet_scenes.h"
#include "prescene/geometry/sampling.h"
#include "sphere_scenes.h"
#include "tests/support/allocations.h"

namespace prescene::tests::spheres_concave_test {
namespace {

using geometry::BoxShape;

double energy_of(const Scene& scene, const WorldState& state, std::size_t i) {
  const geometry::Matrix3d R = state.objects[i].X_WO.rotation.toRotationMatrix();
  const Vector3d w = R.transpose() * state.objects[i].V_WO.angular;
  const Vector3d v =
      state.objects[i].V_WO.linear + state.objects[i].V_WO.angular.cross(R * state.objects[i].physical.center_of_mass);
  return 0.5 * v.squaredNorm() + 0.5 * w.dot(scene.model_of(scene.objects[i]).unit_inertia * w);
}

/// For a second all objects keep their poses but for `way` (m) and `turn` (rad), below the rest rule's energy.
void expect_rest(const Scene& scene, simulation::Instance& instance, double way, double turn) {
  const WorldState before = instance.state();
  for (int n = 0; n < 240; ++n) {
    instance.step();
    const WorldState now = instance.state();
    for (std::size_t i = 0; i < now.objects.size(); ++i) {
      ASSERT_LT(energy_of(scene, now, i), BulletOptions{}.rest.energy) << "object " << i << " after " << n;
      ASSERT_LT((now.objects[i].X_WO.translation - before.objects[i].X_WO.translation).norm(), way) << i;
      ASSERT_LT(geometry::angle_between(now.objects[i].X_WO.rotation, before.objects[i].X_WO.rotation), turn) << i;
    }
  }
}

Scene hook_scene() {
  Scene scene;
  scene.name = "hook";
  const Quaterniond along_y = about(Vector3d::UnitX(), 0.5 * kPi);
  scene.supports.push_back(support_of(
      "hook", {belief::PrimitiveShape{geometry::Capsule{0.004, 0.1}, Pose{along_y, Vector3d::Zero()}}}, Pose{}));
  ObjectModel model = packed_model("mug", mug(), 0.3);
  model.contact.rolling_friction = 5e-4;  // without it, it rolls on its hook for half a minute
  add_object(scene, model, "mug");
  return scene;
}

WorldState hook_start(const Scene& scene) {
  WorldState start = start_of(scene);
  // The hook is inside of the handle, near its upper end.
  const Quaterniond tilt = about(Vector3d::UnitY(), 0.3);
  start.objects[0].X_WO = Pose{tilt, -(tilt * Vector3d(0.0445, 0.0, 0.057))};
  return start;
}

TEST(ConcaveSpheres, AMugSwingsOnItsHookAndStaysThere) {
  const Scene scene = hook_scene();
  auto instance = instance_of(scene);
  instance->set_state(hook_start(scene));
  for (int n = 0; n < 10 * 240; ++n) {
    instance->step();
    if (n % 8 != 0) continue;
    // The hook's axis crosses the handle's plane inside of its hole, by its radius but for the facets.
    const Pose X_MW = instance->state().objects[0].X_WO.inverse();
    const Vector3d from = X_MW * Vector3d(0.0, -0.05, 0.0);
    const Vector3d along = X_MW * Vector3d(0.0, 0.05, 0.0) - from;
    const Vector3d at = from - from.y() / along.y() * along - Vector3d(0.0385, 0.0, 0.045);
    ASSERT_LT(std::hypot(at.x(), at.z()), 0.02 - 0.004 + 0.0004) << "at step " << n;
    ASSERT_GT(at.x(), 0.0) << "in the wall at step " << n;
  }
  expect_rest(scene, *instance, 2e-3, 0.03);
  EXPECT_LT(instance->state().objects[0].X_WO.translation.z(), -0.05);
}

TEST(ConcaveSpheres, ABowlLiesInABowl) {
  // Round below, the two rock together. Each half swing takes an angle of twice the rolling arm over the depth of their
  // centre below the middle of the round, 0.04 rad, so that they stop within two seconds; without an arm nothing stops
  // them.
  ObjectModel model = packed_model("lower", bowl(0.06, 0.05, 0.003), 0.3);
  model.contact.rolling_friction = 5e-4;
  Scene scene = floor_scene(model);
  model.name = "upper";
  add_object(scene, model, "upper");
  for (int i = 0; i < 3; ++i) {
    SCOPED_TRACE("start " + std::to_string(i));
    auto instance = instance_of(scene);
    WorldState start = start_of(scene);
    start.objects[0].X_WO.translation = {0.0, 0.0, 0.001};
    start.objects[1].X_WO = Pose{about({1.0, 0.3 + 0.2 * i, 0.0}, 0.3), {0.005 - 0.002 * i, 0.002, 0.06}};
    instance->set_state(start);
    step_for(*instance, 3.0);
    // Where the smaller outside touches the larger inside, its centre is off by the difference of the radii, as the
    // ball of a bowl of 57 mm and one of 60 mm touch: on the rims, not on the bottoms.
    const WorldState end = instance->state();
    const Vector3d up = end.objects[1].X_WO.translation - end.objects[0].X_WO.translation;
    EXPECT_GT(up.z(), 0.003);
    EXPECT_LT(up.z(), 0.02);
    EXPECT_LT(up.head<2>().norm(), 0.015);
    expect_rest(scene, *instance, 5e-4, 5e-3);
  }
}

TEST(ConcaveSpheres, ASpoonLeansInAMug) {
  Scene scene = floor_scene(packed_model("mug", mug(), 0.3));
  add_object(scene, packed_model("spoon", spoon(), 0.04), "spoon");
  auto instance = instance_of(scene);
  WorldState start = start_of(scene);
  start.objects[0].X_WO.translation = {0.0, 0.0, 0.0005};
  start.objects[1].X_WO = Pose{about(Vector3d::UnitY(), 0.2), {-0.02, 0.0, 0.03}};
  instance->set_state(start);
  step_for(*instance, 4.0);
  const WorldState end = instance->state();
  const Pose X_MS = end.objects[0].X_WO.inverse() * end.objects[1].X_WO;
  // Its bowl is inside, over the bottom; its stem looks out.
  EXPECT_LT((X_MS * Vector3d(0.022, 0.0, 0.0)).head<2>().norm(), 0.037);
  EXPECT_GT((X_MS * Vector3d(0.022, 0.0, 0.0)).z(), 0.003);
  EXPECT_LT((X_MS * Vector3d(0.022, 0.0, 0.0)).z(), 0.04);
  EXPECT_GT((X_MS * Vector3d(0.0175, 0.0, 0.138)).z(), 0.09);
  expect_rest(scene, *instance, 1e-4, 5e-3);
}

TEST(ConcaveSpheres, ACartonLiesOnTheRimOfABin) {
  for (const belief::MeshUse use : {belief::MeshUse::kSpheres, belief::MeshUse::kSurface}) {
    Scene scene = floor_scene(packed_model("carton", geometry::make_gable_carton(0.07, 0.07, 0.15, 0.2)));
    belief::MeshShape bin = packed(geometry::make_open_bin({0.2, 0.12, 0.1}, 0.003));
    bin.use = use;
    scene.supports.push_back(support_of("bin", {bin}, Pose{}));
    auto instance = instance_of(scene);
    WorldState start = start_of(scene);
    start.objects[0].X_WO = Pose{about(Vector3d::UnitX(), 0.5 * kPi), {0.0, 0.0, 0.15}};
    instance->set_state(start);
    step_for(*instance, 2.0);
    // Its side lies on both rims, tilted as its gable is cut off.
    EXPECT_NEAR(instance->state().objects[0].X_WO.translation.z(), 0.103 + 0.03, 3e-3);
    expect_rest(scene, *instance, 1e-6, 1e-5);
  }
}

/// A table that ends at x = 0.
Scene edge_scene(const ObjectModel& model) {
  Scene scene;
  scene.name = "edge";
  scene.supports.push_back(support_of("table", {belief::PrimitiveShape{BoxShape{{1.0, 1.0, 0.04}}, Pose{}}},
                                      Pose::from_translation({-0.5, 0.0, -0.02})));
  add_object(scene, model, "thing");
  return scene;
}

/// Whether it falls, set down with its centre of mass at x.
bool falls_from_edge(const ObjectModel& model, double x, double yaw) {
  const Scene scene = edge_scene(model);
  auto instance = instance_of(scene);
  WorldState start = start_of(scene);
  const Quaterniond turn = about(Vector3d::UnitZ(), yaw);
  const Vector3d center = turn * start.objects[0].physical.center_of_mass;
  const double bottom = geometry::bounding_box(belief::collision_mesh(model)).min().z();
  start.objects[0].X_WO = Pose{turn, {x - center.x(), 0.01 - center.y(), -bottom}};
  instance->set_state(start);
  step_for(*instance, 2.0);
  return instance->state().objects[0].X_WO.translation.z() < -bottom - 0.01;
}

TEST(ConcaveSpheres, ThatStandOnARimAreNotTakenToBeInsideIt) {
  // A side of the thing is a few millimetres behind the table's rim, flush with it below: nothing pushes it sideways.
  const geometry::TriangleMesh box = geometry::make_mesh(BoxShape{{0.1, 0.1, 0.1}});
  for (const int spheres : {300, 1000, 3000}) {
    const ObjectModel model = packed_model("thing", box, 0.2, {spheres, 5e-4});
    for (const double overlap : {0.0005, 0.002, 0.006, 0.02}) {
      Scene scene = edge_scene(model);
      auto instance = instance_of(scene);
      WorldState start = start_of(scene);
      start.objects[0].X_WO = Pose::from_translation({0.05 - overlap, 0.01, 0.05});
      instance->set_state(start);
      instance->step();
      const Vector3d moved = instance->state().objects[0].X_WO.translation - start.objects[0].X_WO.translation;
      EXPECT_LT(moved.head<2>().norm(), 8e-5) << spheres << " spheres, overlap " << overlap;
    }
  }
}

TEST(ConcaveSpheres, FallFromAnEdgeOnceTheirWeightIsBeyondIt) {
  const auto a_cup = [](double floor) {
    return geometry::make_lathe({{0.0, 0.0}, {0.035, 0.0}, {0.04, 0.09}, {0.036, 0.09}, {0.031, floor}, {0.0, floor}},
                                32);
  };
  const geometry::TriangleMesh meshes[] = {a_cup(0.002), a_cup(0.004), a_cup(0.01),
                                           geometry::make_open_bin({0.08, 0.06, 0.1}, 0.003),
                                           geometry::make_mesh(BoxShape{{0.08, 0.06, 0.1}})};
  for (std::size_t i = 0; i < std::size(meshes); ++i) {
    const ObjectModel model = packed_model("thing", meshes[i], 0.2, {1500, 5e-4});
    for (const double yaw : {0.0, 0.3, 0.7, 2.0}) {
      // The table's edge is rounded by 0.2 mm, as that of a box on it would be.
      EXPECT_FALSE(falls_from_edge(model, -8e-4, yaw)) << i << " turned by " << yaw;
      EXPECT_TRUE(falls_from_edge(model, 1e-4, yaw)) << i << " turned by " << yaw;
    }
  }
}

TEST(ConcaveSpheres, FastThingsDoNotPassThroughThinWalls) {
  const geometry::TriangleMesh wall = geometry::make_mesh(BoxShape{{0.002, 1.0, 1.0}});
  const belief::MeshShape surface{std::make_shared<const geometry::TriangleMesh>(wall), Pose{},
                                  belief::MeshUse::kSurface};
  core::RandomStream stream(3, core::Purpose::kTest);
  for (const belief::CollisionShape& shape :
       {belief::CollisionShape(packed(wall, {5000, 5e-4})),
        belief::CollisionShape(belief::PrimitiveShape{BoxShape{{0.002, 1.0, 1.0}}, Pose{}}),
        belief::CollisionShape(surface)}) {
    Scene scene;
    scene.name = "wall";
    scene.supports.push_back(support_of("wall", {shape}, Pose{}));
    add_object(scene, packed_model("cup", cup(0.02, 0.04, 0.002)), "cup");
    auto instance = instance_of(scene);
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

/// Cups, a bowl and a box on a floor and in a bin: every kind of contact that spheres have.
Scene busy_scene() {
  Scene scene = floor_scene(packed_model("bowl", bowl(0.06, 0.05, 0.003), 0.3, {1500}));
  const auto bin = std::make_shared<const geometry::TriangleMesh>(geometry::make_open_bin({0.2, 0.2, 0.1}, 0.004));
  scene.supports.push_back(support_of("bin", {belief::MeshShape{bin, Pose{}, belief::MeshUse::kSurface}}, Pose{}));
  add_object(scene, packed_model("cup", cup(0.025, 0.06, 0.002), 0.1, {1500}), "cup");
  add_object(scene, primitive_model("box", BoxShape{{0.03, 0.02, 0.03}}, 0.1), "box");
  return scene;
}

std::vector<WorldState> busy_starts(const Scene& scene, int count) {
  std::vector<WorldState> starts;
  core::RandomStream stream(11, core::Purpose::kTest);
  for (int i = 0; i < count; ++i) {
    WorldState start = start_of(scene);
    for (std::size_t k = 0; k < start.objects.size(); ++k) {
      start.objects[k].X_WO.translation =
          Vector3d(0.0, 0.0, 0.15 + 0.12 * static_cast<double>(k)) + 0.02 * geometry::normal_vector(stream);
      start.objects[k].X_WO.rotation = geometry::uniform_rotation(stream);
    }
    starts.push_back(start);
  }
  return starts;
}

TEST(ConcaveSpheres, ThreadsSplitsAndSkippedFlightsGiveTheSameBits) {
  const Scene scene = busy_scene();
  const std::vector<WorldState> starts = busy_starts(scene, 6);
  simulation::RunRequest request;
  request.stop.duration = 1.0;
  request.sample_interval = 0.1;
  const auto run_all = [&](int threads, bool skip_flight) {
    BulletOptions options;
    options.skip_flight = skip_flight;
    core::ThreadPool pool(threads);
    std::vector<belief::Trajectory> runs(starts.size());
    simulator_of(scene, options)->run(starts, request, core::RandomStream(5, core::Purpose::kAction), 0, pool, runs);
    return runs;
  };
  const std::vector<belief::Trajectory> reference = run_all(1, true);
  EXPECT_EQ(run_all(3, true), reference);
  std::vector<belief::Trajectory> stepped = run_all(1, false);
  for (std::size_t i = 0; i < stepped.size(); ++i) {
    EXPECT_EQ(stepped[i].states, reference[i].states) << i;
    EXPECT_EQ(stepped[i].contacts, reference[i].contacts) << i;
  }
}

TEST(ConcaveSpheres, SavedAndRestoredInstancesStepAlike) {
  const Scene scene = busy_scene();
  const auto simulator = simulator_of(scene);
  const core::RandomStream stream(5, core::Purpose::kAction);
  auto original = simulator->make_instance({}, stream);
  auto used = simulator->make_instance({}, stream);
  for (const WorldState& start : busy_starts(scene, 2)) {
    original->set_state(start);
    for (const int when : {40, 80}) {
      for (int n = 0; n < when; ++n) original->step();
      const simulation::Snapshot snapshot = original->save();
      ASSERT_TRUE(used->restore(snapshot).ok());
      for (int n = 0; n < 40; ++n) {
        original->step();
        used->step();
        ASSERT_EQ(original->save().bytes, used->save().bytes) << when << " + " << n;
      }
    }
  }
}

TEST(ConcaveSpheres, WarmedUpStepsDoNotAllocate) {
  if (!can_count_allocations()) GTEST_SKIP() << "allocations can't be counted under sanitizers";
  const Scene scene = busy_scene();
  auto instance = instance_of(scene);
  const std::vector<WorldState> starts = busy_starts(scene, 2);
  for (const WorldState& start : starts) {
    instance->set_state(start);
    for (int n = 0; n < 240; ++n) instance->step();
  }
  instance->set_state(starts[0]);
  const std::uint64_t before = allocation_count();
  for (int n = 0; n < 240; ++n) instance->step();
  EXPECT_EQ(allocation_count(), before);
}

TEST(ConcaveSpheres, AreMadeOnceAndRefusedWithAReason) {
  simulation::ShapeStore shapes;
  const auto shared = [](geometry::TriangleMesh of) {
    return std::make_shared<const geometry::TriangleMesh>(std::move(of));
  };
  const belief::MeshPtr mesh = shared(mug());
  const auto first = shapes.surface_spheres(mesh, {1000, 0.0});
  ASSERT_TRUE(first.ok());
  EXPECT_EQ(*shapes.surface_spheres(mesh, {1000, 0.0}), *first);
  EXPECT_NE(*shapes.surface_spheres(mesh, {2000, 0.0}), *first);
  EXPECT_EQ(shapes.built(), 2U);
  geometry::TriangleMesh open = *mesh;
  open.triangles.pop_back();
  EXPECT_THAT(shapes.surface_spheres(shared(open), {}).status().message(), testing::HasSubstr("open"));
  for (auto& t : open.triangles = mesh->triangles) std::swap(t[0], t[1]);
  EXPECT_THAT(shapes.surface_spheres(shared(open), {}).status().message(), testing::HasSubstr("inside out"));
  EXPECT_FALSE(shapes.surface_spheres(mesh, {10, 0.0}).ok());
  EXPECT_FALSE(shapes.surface_spheres(mesh, {1000, -1.0}).ok());
}

}  // namespace
}  // namespace prescene::tests::spheres_concave_test
