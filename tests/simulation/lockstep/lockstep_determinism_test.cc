// SPDX-License-Identifier: Apache-2.0
// The same bits whichever instances are simulated together, on any number of threads and with any instruction set; and
// what is refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <hwy/highway.h>

#include <algorithm>

#include "lockstep_scenes.h"
#include "prescene/geometry/sampling.h"
#include "prescene/simulation/own_actions.h"
#include "prescene/simulation/similarity.h"
#include "tests/support/allocations.h"
#include "tests/support/hollow_meshes.h"
#include "tests/support/uncertain_scenes.h"

namespace prescene::tests {
namespace {

using geometry::BoxShape;

/// Two boxes and a hull that fall into a bin of boxes with a hull inside: every kind of contact.
Scene busy_scene() {
  Scene scene = carton_over_bin();
  const auto carton = geometry::make_gable_carton(0.07, 0.07, 0.15, 0.2);
  belief::CollisionShape roof = hull_of(geometry::make_gable_carton(0.06, 0.06, 0.02, 0.05));
  scene.supports.push_back(support_of("roof", {roof}, Pose::from_translation({0.0, 0.0, 0.035})));
  belief::ObjectModel& model = scene.models[0];
  model.collision = {hull_of(carton),
                     belief::PrimitiveShape{BoxShape{{0.12, 0.03, 0.03}}, Pose::from_translation({0, 0, -0.05})},
                     belief::PrimitiveShape{geometry::Cylinder{0.02, 0.12}, Pose::from_translation({0, 0, 0.05})}};
  model.contact.rolling_friction = 1e-4;
  scene.exclusive_outcomes.clear();
  return scene;
}

/// A hand carries one of three things over the others, lets go of it while it turns, and backs off; a finger pushes
/// another one: every way to move, and objects on objects.
Scene handed_scene() {
  Scene scene;
  scene.name = "handed";
  scene.supports.push_back(floor_support());
  const belief::PrimitiveShape post{geometry::Cylinder{0.03, 0.1}, Pose{}};
  scene.supports.push_back(support_of("post", {post}, Pose::from_translation({0.09, 0.02, 0.05})));
  const auto add = [&](const std::string& name, const belief::CollisionShape& shape, const Vector3d& position) {
    ObjectModel model = model_of(name, {shape}, 0.5);
    model.contact.rolling_friction = 1e-4;
    model.contact.restitution = belief::FixedScalar{0.3};
    belief::NormalPose pose;
    pose.mean = Pose::from_translation(position);
    pose.covariance = geometry::Matrix6d(geometry::Matrix6d::Identity()) * 1e-4;
    scene.objects[static_cast<std::size_t>(add_object(scene, model, name))].pose = pose;
  };
  add("carton", hull_of(geometry::make_gable_carton(0.07, 0.07, 0.15, 0.2)), {-0.1, 0.0, 0.4});
  add("brick", belief::PrimitiveShape{BoxShape{{0.12, 0.1, 0.06}}, Pose{}}, {0.0, 0.0, 0.06});
  add("can", belief::PrimitiveShape{geometry::Cylinder{0.03, 0.1}, Pose{}}, {0.0, 0.0, 0.17});
  belief::KinematicBody hand;
  hand.name = "hand";
  hand.collision = {belief::PrimitiveShape{BoxShape{{0.08, 0.08, 0.02}}, Pose{}},
                    belief::PrimitiveShape{geometry::Capsule{0.01, 0.05}, Pose::from_translation({0, 0, 0.05})}};
  hand.timeline = {{0.0, Pose::from_translation({-0.1, 0.0, 0.51})},
                   {0.3, Pose{about(Vector3d::UnitY(), 0.3), {0.0, 0.0, 0.51}}}};
  scene.robot.push_back(hand);
  scene.objects[0].held_by = "hand";
  belief::Release release;
  release.object = "carton";
  release.retreat = {0.0, 0.0, 0.1};
  release.disturbance.angular.x = belief::NormalScalar{0.0, 0.5};
  belief::Push push;
  push.from = {-0.2, 0.0, 0.03};
  push.to = {0.05, 0.0, 0.03};
  push.lateral_error = belief::NormalScalar{0.0, 0.01};
  push.duration = 0.5;
  scene.actions = {{0.2, release}, {0.3, push}};
  return scene;
}

/// A cup, a bowl and a ball fall on each other and on a bin of boxes, all hollow things of spheres: every kind of
/// contact that they have.
Scene hollow_scene() {
  Scene scene = carton_over_bin();
  scene.objects.clear();
  scene.models.clear();
  scene.exclusive_outcomes.clear();
  scene.name = "hollow";
  const auto add = [&](const std::string& name, const belief::CollisionShape& shape, const Vector3d& position) {
    ObjectModel model = model_of(name, {shape}, 0.2);
    model.contact.restitution = belief::FixedScalar{0.3};
    belief::NormalPose pose;
    pose.mean = Pose::from_translation(position);
    pose.covariance = geometry::Matrix6d(geometry::Matrix6d::Identity()) * 4e-4;
    scene.objects[static_cast<std::size_t>(add_object(scene, model, name))].pose = pose;
  };
  add("bowl", spheres_of(bowl(0.06, 0.05, 0.003), {250, 0.0}), {0.06, 0.0, 0.3});
  add("cup", spheres_of(cup(0.025, 0.06, 0.002), {250, 0.0}), {0.06, 0.01, 0.42});
  add("ball", belief::PrimitiveShape{geometry::Sphere{0.015}, Pose{}}, {0.05, 0.0, 0.55});
  return scene;
}

simulation::RunRequest short_request(const Scene& scene) {
  simulation::RunRequest request;
  request.actions = scene.actions;
  request.stop.duration = 1.2;
  request.sample_interval = 0.1;
  return request;
}

/// On one object, on several that are moved, and on hollow ones.
class LockstepBits : public testing::TestWithParam<const char*> {
 protected:
  Scene scene() const {
    const std::string name = GetParam();
    return name == "handed" ? handed_scene() : name == "hollow" ? hollow_scene() : busy_scene();
  }
};
INSTANTIATE_TEST_SUITE_P(Scenes, LockstepBits, testing::Values("busy", "handed", "hollow"),
                         [](const auto& which) { return std::string(which.param); });

TEST_P(LockstepBits, AnyThreadCountOrderSplitAndReuseGivesTheSameBits) {
  const Scene scene = this->scene();
  const std::vector<WorldState> starts = drawn_starts(scene, 60, 3);
  const simulation::RunRequest request = short_request(scene);
  const auto simulator = lockstep_of(scene);
  const std::vector<belief::Trajectory> reference = run_all(*simulator, starts, request);
  std::size_t contacts = 0;
  for (const belief::Trajectory& t : reference) contacts += t.contacts.size();
  ASSERT_GT(contacts, 100U);
  for (const int threads : {1, 2, 3})
    EXPECT_TRUE(run_all(*simulator, starts, request, threads) == reference) << threads;

  // What is random in actions goes with the place in the queue.
  if (scene.actions.empty()) {
    std::vector<WorldState> reversed(starts.rbegin(), starts.rend());
    std::vector<belief::Trajectory> runs = run_all(*simulator, reversed, request);
    std::reverse(runs.begin(), runs.end());
    EXPECT_TRUE(runs == reference);
  }

  LockstepOptions few;
  few.live_instances = 5;
  EXPECT_TRUE(run_all(*lockstep_of(scene, few), starts, request) == reference);
  for (std::size_t i = 0; i < 10; ++i) {
    EXPECT_TRUE(run_all(*simulator, {starts[i]}, request, 1, static_cast<std::uint32_t>(i))[0] == reference[i]) << i;
  }
}

TEST_P(LockstepBits, InstancesWithActionsOfTheirOwnHaveTheBitsOfRunsOfTheirOwn) {
  const Scene scene = this->scene();
  const std::vector<WorldState> starts = drawn_starts(scene, 24, 6);
  std::vector<std::vector<belief::Action>> actions(starts.size(), scene.actions);
  for (std::size_t i = 0; i < starts.size(); ++i) {
    belief::Push push;
    push.from = {-0.3 + 0.01 * static_cast<double>(i), 0.02, 0.03};
    push.to = {0.1, 0.0, 0.03};
    push.duration = 0.2 + 0.02 * static_cast<double>(i);
    push.radius = i % 5 == 0 ? 0.01 : 0.015;
    if (i % 7 != 0) actions[i].push_back({0.05, push});
  }
  simulation::RunRequest request = short_request(scene);
  request.actions.clear();
  const core::RandomStream stream(11, core::Purpose::kTest);
  for (const simulation::Similarity similarity : {simulation::Similarity{1.0}, simulation::Similarity{0.5}}) {
    auto simulator = lockstep_of(simulation::scaled(scene, similarity.inverse()));
    if (similarity.length != 1.0) simulator = simulation::make_scaled_simulator(std::move(simulator), similarity);
    std::vector<belief::Trajectory> together(starts.size()), reference(starts.size());
    core::ThreadPool pool(2);
    simulation::run_own_actions(*simulator, starts, actions, request, stream, 3, pool, together);
    for (std::size_t i = 0; i < starts.size(); ++i) {
      simulation::RunRequest mine = request;
      mine.actions = actions[i];
      simulator->run(std::span(starts).subspan(i, 1), mine, stream, static_cast<std::uint32_t>(3 + i), pool,
                     std::span(reference).subspan(i, 1));
    }
    EXPECT_TRUE(together == reference) << similarity.length;
    EXPECT_FALSE(reference[1].states.back() == reference[2].states.back());
  }
}

TEST_P(LockstepBits, AllInstructionSetsGiveTheSameBits) {
  const Scene scene = this->scene();
  const std::vector<WorldState> starts = drawn_starts(scene, 40, 4);
  const simulation::RunRequest request = short_request(scene);
  const std::vector<belief::Trajectory> reference = run_all(*lockstep_of(scene), starts, request);
  hwy::SetSupportedTargetsForTest(0);
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().DeInit();
    EXPECT_TRUE(run_all(*lockstep_of(scene), starts, request) == reference) << hwy::TargetName(target);
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().DeInit();
}

TEST_P(LockstepBits, InstancesStepAsRunsDo) {
  const Scene scene = this->scene();
  simulation::RunRequest request = short_request(scene);
  request.stop.stop_at_rest = false;
  const auto simulator = lockstep_of(scene);
  auto instance = simulator->make_instance(scene.actions, core::RandomStream(5, core::Purpose::kTest).at(0, 0));
  for (const WorldState& start : drawn_starts(scene, 5, 5)) {
    instance->set_state(start);
    step_for(*instance, request.stop.duration);
    EXPECT_TRUE(instance->state() == run_all(*simulator, {start}, request)[0].final());
  }
}

TEST_P(LockstepBits, SavedAndRestoredInstancesStepAlike) {
  const Scene scene = this->scene();
  const auto simulator = lockstep_of(scene);
  const core::RandomStream stream(5, core::Purpose::kTest);
  auto original = simulator->make_instance(scene.actions, stream);
  auto used = simulator->make_instance(scene.actions, stream);
  for (const WorldState& start : drawn_starts(scene, 4, 6)) {
    original->set_state(start);
    for (const int when : {20, 95, 170, 260}) {
      for (int n = 0; n < when; ++n) original->step();
      const simulation::Snapshot snapshot = original->save();
      auto fresh = simulator->make_instance(scene.actions, stream);
      ASSERT_TRUE(used->restore(snapshot).ok());
      ASSERT_TRUE(fresh->restore(snapshot).ok());
      for (int n = 0; n < 60; ++n) {
        original->step();
        used->step();
        fresh->step();
        ASSERT_EQ(original->save().bytes, used->save().bytes) << when << " + " << n;
        ASSERT_EQ(original->save().bytes, fresh->save().bytes) << when << " + " << n;
      }
      ASSERT_EQ(original->at_rest(), used->at_rest());
      ASSERT_EQ(original->save().bytes, used->save().bytes) << "asking whether it rests changed it";
      used->step();  // out of phase for the next restore
    }
  }
  simulation::Snapshot half = original->save();
  half.bytes.resize(half.bytes.size() / 2);
  EXPECT_EQ(original->restore(half).code(), core::StatusCode::kInvalidInput);
}

TEST_P(LockstepBits, WarmedUpStepsDoNotAllocate) {
  if (!can_count_allocations()) GTEST_SKIP() << "allocations can't be counted under sanitizers";
  const Scene scene = this->scene();
  auto instance = lockstep_of(scene)->make_instance(scene.actions, core::RandomStream(1, core::Purpose::kTest));
  const std::vector<WorldState> starts = drawn_starts(scene, 2, 7);
  instance->set_state(starts[0]);
  for (int n = 0; n < 300; ++n) instance->step();
  instance->set_state(starts[1]);
  const std::uint64_t before = allocation_count();
  for (int n = 0; n < 300; ++n) instance->step();
  EXPECT_EQ(allocation_count(), before);
}

TEST_P(LockstepBits, LiveInstancesTakeLittleMemory) {
  if (!can_count_allocations()) GTEST_SKIP() << "memory can't be counted under sanitizers";
  const Scene scene = this->scene();
  const auto bytes_of = [&](int live) {
    LockstepOptions options;
    options.live_instances = live;
    const auto simulator = lockstep_of(scene, options);
    const std::vector<WorldState> starts = drawn_starts(scene, live, 2);
    const std::uint64_t before = heap_bytes();
    run_all(*simulator, starts, short_request(scene));
    return static_cast<double>(heap_bytes() - before);
  };
  // Bodies of spheres have room for twice as many contacts. What sleeps takes 1.5 KiB an object, what a hand does to it
  // 0.3; what pressed in an earlier part of a step, while hands move, up to 8 in all.
  const std::string name = GetParam();
  EXPECT_LT((bytes_of(256) - bytes_of(64)) / 192, (name == "hollow" ? 32.0 : name == "handed" ? 30.0 : 22.0) * 1024);
}

TEST(LockstepDeterminism, CancelledRunsEnd) {
  const Scene scene = busy_scene();
  const std::vector<WorldState> starts = drawn_starts(scene, 150, 8);
  core::Cancellation cancellation;
  cancellation.request();
  core::ThreadPool pool(2);
  std::vector<belief::Trajectory> runs(starts.size());
  lockstep_of(scene)->run(starts, short_request(scene), core::RandomStream(1, core::Purpose::kTest), 0, pool, runs,
                          &cancellation);
  for (const belief::Trajectory& run : runs) {
    EXPECT_EQ(run.end, belief::TrajectoryEnd::kCancelled);
    EXPECT_EQ(run.states.size(), 2U);
  }
}

class Below30Centimetres : public simulation::EndRule {
 public:
  bool ends(const WorldState& state, double) const override { return state.objects[0].X_WO.translation.z() < 0.3; }
};

TEST(LockstepDeterminism, DecidedInstancesEndEarlyOnTheSamePath) {
  const Scene scene = busy_scene();
  const std::vector<WorldState> starts = drawn_starts(scene, 20, 9);
  simulation::RunRequest request = short_request(scene);
  request.sample_interval = 4.0 / 240.0;
  const std::vector<belief::Trajectory> whole = run_all(*lockstep_of(scene), starts, request);
  const Below30Centimetres rule;
  request.end_rule = &rule;
  const std::vector<belief::Trajectory> decided = run_all(*lockstep_of(scene), starts, request);
  std::size_t early = 0;
  for (std::size_t i = 0; i < starts.size(); ++i) {
    if (decided[i].end != belief::TrajectoryEnd::kDecided) continue;
    ++early;
    const std::size_t last = decided[i].states.size() - 1;
    ASSERT_LE(decided[i].simulated_seconds, whole[i].simulated_seconds);
    EXPECT_LT(decided[i].final().objects[0].X_WO.translation.z(), 0.3);
    EXPECT_GE(decided[i].states[last - 1].objects[0].X_WO.translation.z(), 0.3);
    EXPECT_TRUE(decided[i].states[last] == whole[i].states[last]) << i;
  }
  EXPECT_GT(early, 5U);
}

core::Status refusal(const Scene& scene) {
  simulation::ShapeStore shapes(simulation::hacd_decomposer());
  const auto simulator = simulation::make_lockstep_simulator(scene, shapes);
  return simulator.ok() ? core::ok_status() : simulator.status();
}

TEST(LockstepRefusals, NameTheBodyAndTheReason) {
  using testing::HasSubstr;
  const Scene good = floor_scene(primitive_model("box", BoxShape{{0.1, 0.1, 0.1}}));
  EXPECT_TRUE(refusal(good).ok());
  const auto expect_refused = [](const Scene& scene, const char* text) {
    const core::Status status = refusal(scene);
    EXPECT_EQ(status.code(), core::StatusCode::kUnsupported) << text;
    EXPECT_THAT(status.message(), HasSubstr(text));
  };
  Scene jointed = good;
  belief::Joint joint;
  joint.name = "slide";
  joint.type = belief::JointType::kSlider;
  joint.child = jointed.objects[0].name;
  jointed.joints.push_back(joint);
  expect_refused(jointed, "the joint slide");
  Scene many = good;
  for (int i = 1; i < 17; ++i) {
    add_object(many, primitive_model("box" + std::to_string(i), BoxShape{{0.1, 0.1, 0.1}}), std::to_string(i));
  }
  expect_refused(many, "one to 16 objects, and the scene has 17");
  Scene surface = good;
  const auto bin = std::make_shared<const geometry::TriangleMesh>(geometry::make_open_bin({0.3, 0.3, 0.2}, 0.01));
  surface.supports.push_back(support_of("bin", {belief::MeshShape{bin, Pose{}, belief::MeshUse::kSurface}}, Pose{}));
  expect_refused(surface, "bin, shape 1: triangle surfaces");
  EXPECT_TRUE(refusal(floor_scene(model_of("cup", {spheres_of(cup(0.04, 0.09, 0.003))}))).ok());
  Scene push = good;
  push.actions.resize(17, {0.1, belief::Push{}});
  expect_refused(push, "17 push actions");
  LockstepOptions options;
  options.live_instances = 0;
  simulation::ShapeStore shapes(nullptr);
  EXPECT_EQ(simulation::make_lockstep_simulator(good, shapes, options).status().code(),
            core::StatusCode::kInvalidInput);
}

}  // namespace
}  // namespace prescene::tests
