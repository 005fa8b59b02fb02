// SPDX-License-Identifier: Apache-2.0
// The same bits from fresh worlds, reused worlds, restored ones, any number of threads and any split into calls.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bullet_scenes.h"
#include "prescene/geometry/sampling.h"
#include "tests/support/allocations.h"

namespace prescene::tests {
namespace {

using geometry::BoxShape;

/// A bin of triangles, a plate of five convex walls, a hull, a compound of two boxes, and a pusher: every kind of
/// contact.
Scene busy_scene() {
  Scene scene;
  scene.name = "busy";
  scene.supports.push_back(floor_support());
  const auto bin = std::make_shared<const geometry::TriangleMesh>(geometry::make_open_bin({0.3, 0.3, 0.2}, 0.01));
  scene.supports.push_back(support_of("bin", {belief::MeshShape{bin, Pose{}, belief::MeshUse::kSurface}}, Pose{}));
  const auto carton =
      std::make_shared<const geometry::TriangleMesh>(geometry::make_gable_carton(0.07, 0.07, 0.15, 0.2));
  add_object(scene, model_of("carton", {belief::MeshShape{carton, Pose{}, belief::MeshUse::kConvexHull}}), "carton");
  add_object(scene,
             model_of("cross", {belief::PrimitiveShape{BoxShape{{0.12, 0.03, 0.03}}, Pose{}},
                                belief::PrimitiveShape{BoxShape{{0.03, 0.12, 0.03}}, Pose{}}}),
             "cross");
  add_object(scene, primitive_model("can", geometry::Cylinder{0.03, 0.1}), "can");
  for (belief::ObjectModel& model : scene.models) model.contact.restitution = belief::FixedScalar{0.3};
  belief::Push push;
  push.from = {-0.4, 0.0, 0.03};
  push.to = {0.4, 0.05, 0.03};
  push.lateral_error = belief::NormalScalar{0.0, 0.02, -0.1, 0.1};
  scene.actions.push_back({0.3, push});
  return scene;
}

std::vector<WorldState> busy_starts(const Scene& scene, int count) {
  std::vector<WorldState> starts;
  core::RandomStream stream(7, core::Purpose::kTest);
  for (int i = 0; i < count; ++i) {
    WorldState start = belief::mean_start(scene);
    for (std::size_t k = 0; k < start.objects.size(); ++k) {
      belief::ObjectState& object = start.objects[k];
      object.X_WO.translation = Vector3d(0.0, 0.0, 0.25 + 0.15 * static_cast<double>(k)) +
                                0.08 * geometry::normal_vector(stream).cwiseProduct(Vector3d(1.0, 1.0, 0.1));
      object.X_WO.rotation = geometry::uniform_rotation(stream);
      object.V_WO.angular = 3.0 * geometry::normal_vector(stream);
    }
    starts.push_back(start);
  }
  return starts;
}

simulation::RunRequest request_of(const Scene& scene) {
  simulation::RunRequest request;
  request.actions = scene.actions;
  request.stop.duration = 1.2;
  request.sample_interval = 0.1;
  return request;
}

std::vector<belief::Trajectory> run_all(const simulation::Simulator& simulator, const std::vector<WorldState>& starts,
                                        const simulation::RunRequest& request, int threads) {
  core::ThreadPool pool(threads);
  std::vector<belief::Trajectory> runs(starts.size());
  simulator.run(starts, request, core::RandomStream(5, core::Purpose::kAction), 100, pool, runs);
  return runs;
}

TEST(Determinism, AnyThreadCountSplitAndReuseGivesTheSameBits) {
  const Scene scene = busy_scene();
  const std::vector<WorldState> starts = busy_starts(scene, 12);
  const simulation::RunRequest request = request_of(scene);
  const auto simulator = simulator_of(scene);
  const std::vector<belief::Trajectory> reference = run_all(*simulator, starts, request, 1);
  int contacts = 0;
  for (const belief::Trajectory& t : reference) contacts += static_cast<int>(t.contacts.size());
  ASSERT_GT(contacts, 50);

  // The worlds of this simulator have run other instances by now.
  EXPECT_EQ(run_all(*simulator, starts, request, 1), reference);
  for (const int threads : {2, 3}) EXPECT_EQ(run_all(*simulator, starts, request, threads), reference);

  // One by one in reverse order, each in a simulator of its own: fresh worlds.
  core::ThreadPool pool(1);
  for (std::size_t i = starts.size(); i-- > 0;) {
    const auto fresh = simulator_of(scene);
    std::vector<belief::Trajectory> run(1);
    fresh->run({&starts[i], 1}, request, core::RandomStream(5, core::Purpose::kAction),
               static_cast<std::uint32_t>(100 + i), pool, run);
    EXPECT_EQ(run[0], reference[i]) << i;
  }
}

TEST(Determinism, SavedAndRestoredInstancesStepAlike) {
  const Scene scene = busy_scene();
  const auto simulator = simulator_of(scene);
  const core::RandomStream stream(5, core::Purpose::kAction);
  auto original = simulator->make_instance(scene.actions, stream);
  auto used = simulator->make_instance(scene.actions, stream);
  for (const WorldState& start : busy_starts(scene, 4)) {
    original->set_state(start);
    for (const int when : {20, 95, 170, 260}) {
      for (int n = 0; n < when; ++n) original->step();
      const simulation::Snapshot snapshot = original->save();
      // Into a world in the middle of something else, and into a fresh one.
      auto fresh = simulator->make_instance(scene.actions, stream);
      ASSERT_TRUE(used->restore(snapshot).ok());
      ASSERT_TRUE(fresh->restore(snapshot).ok());
      for (int n = 0; n < 60; ++n) {
        original->step();
        used->step();
        fresh->step();
        ASSERT_EQ(original->state(), used->state()) << when << " + " << n;
        ASSERT_EQ(original->state(), fresh->state()) << when << " + " << n;
        ASSERT_EQ(original->save().bytes, used->save().bytes) << when << " + " << n;
      }
      ASSERT_EQ(original->at_rest(), used->at_rest());
      ASSERT_EQ(original->save().bytes, used->save().bytes) << "asking whether it rests changed it";
      used->step();  // out of phase for the next restore
    }
  }
}

TEST(Determinism, SnapshotsOfOtherScenesAreRefused) {
  const Scene scene = busy_scene();
  auto instance = simulator_of(scene)->make_instance(scene.actions, core::RandomStream(5, core::Purpose::kAction));
  const Scene other = floor_scene(primitive_model("ball", geometry::Sphere{0.1}));
  const WorldState before = instance->state();
  simulation::Snapshot snapshot = instance_of(other)->save();
  EXPECT_EQ(instance->restore(snapshot).code(), core::StatusCode::kInvalidInput);
  snapshot = instance->save();
  snapshot.bytes.resize(snapshot.bytes.size() / 2);
  EXPECT_EQ(instance->restore(snapshot).code(), core::StatusCode::kInvalidInput);
  EXPECT_EQ(instance->state(), before);
}

TEST(Determinism, WarmedUpStepsDoNotAllocate) {
  if (!can_count_allocations()) GTEST_SKIP() << "allocations can't be counted under sanitizers";
  const Scene scene = busy_scene();
  auto instance = simulator_of(scene)->make_instance({}, core::RandomStream(5, core::Purpose::kAction));
  const std::vector<WorldState> starts = busy_starts(scene, 3);
  for (const WorldState& start : starts) {
    instance->set_state(start);
    for (int n = 0; n < 300; ++n) instance->step();
  }
  instance->set_state(starts[0]);
  const std::uint64_t before = allocation_count();
  for (int n = 0; n < 300; ++n) instance->step();
  EXPECT_EQ(allocation_count(), before);
}

}  // namespace
}  // namespace prescene::tests
