// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/live/planning_scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "prescene/core/random.h"
#include "prescene/geometry/triangle_mesh.h"
#include "prescene/interfaces/ros_messages/conversions.h"
#include "tests/support/simple_scenes.h"

namespace prescene::service::planning_scene_test {
namespace {

using belief::TrackState;
using interfaces::RosCollisionObject;
using interfaces::RosCollisionOperation;

/// MoveIt's world as PlanningScene::processCollisionObjectMsg makes it: an object that is added replaces the one of its
/// id, and one that is not there can't be moved.
class World {
 public:
  void take(const RosCollisionObject& message) {
    EXPECT_EQ(message.header.frame_id, "map");
    switch (static_cast<RosCollisionOperation>(message.operation)) {
      case RosCollisionOperation::kAdd:
        EXPECT_EQ(message.primitives.size(), message.primitive_poses.size());
        EXPECT_EQ(message.meshes.size(), message.mesh_poses.size());
        EXPECT_GT(message.primitives.size() + message.meshes.size(), 0U);
        poses[message.id] = message.pose;
        return;
      case RosCollisionOperation::kMove:
        EXPECT_TRUE(poses.contains(message.id)) << message.id;
        EXPECT_TRUE(message.primitives.empty() && message.meshes.empty() && message.planes.empty());
        poses[message.id] = message.pose;
        return;
      case RosCollisionOperation::kRemove:
        poses.erase(message.id);  // one that is repeated finds nothing
        return;
      case RosCollisionOperation::kAppend:
        break;
    }
    ADD_FAILURE() << "no such operation is used";
  }
  std::map<std::string, interfaces::RosPose> poses;
};

belief::Scene scene_of_three() {
  belief::Scene scene = tests::floor_scene(tests::primitive_model("box", geometry::BoxShape{{0.1, 0.2, 0.3}}));
  tests::add_object(scene, tests::primitive_model("ball", geometry::Sphere{0.05}), "ball");
  tests::add_object(scene, tests::primitive_model("pill", geometry::Capsule{0.02, 0.1}), "pill");
  return scene;
}

BeliefSummary summary_of_scene(const belief::Scene& scene) {
  BeliefSummary summary{1, 1'000, {}};
  for (const belief::SceneObject& object : scene.objects) {
    ObjectSummary& known = summary.objects.emplace_back();
    known.name = object.name;
    known.model = scene.model_of(object).name;
  }
  return summary;
}

double distance(const interfaces::RosPose& pose, const geometry::Pose& X_WO) {
  return (geometry::Vector3d(pose.position.x, pose.position.y, pose.position.z) - X_WO.translation).norm();
}

constexpr core::TimeNs kSecond = 1'000'000'000;
constexpr PlanningReaders kOne{1, 1};

/// All that a step sends.
std::vector<RosCollisionObject> told(PlanningScene& planning, const BeliefSummary& summary, const belief::Scene& scene,
                                     const PlanningReaders& readers = kOne) {
  std::vector<RosCollisionObject> messages;
  planning.tell(summary, scene, "map", readers, [&](const RosCollisionObject& message) {
    messages.push_back(message);
    return true;
  });
  return messages;
}

/// "add box", of each message.
std::vector<std::string> words(const std::vector<RosCollisionObject>& messages) {
  const std::map<std::uint8_t, std::string> names = {{0, "add"}, {1, "remove"}, {3, "move"}};
  std::vector<std::string> words;
  for (const RosCollisionObject& message : messages)
    words.push_back(names.at(message.operation) + " " + message.id.substr(std::string("prescene/").size()));
  return words;
}
using Words = std::vector<std::string>;

constexpr PlanningSceneSettings kAllAtOnce{.most_at_once = 100};

TEST(PlanningScene, BecomesAsTheBeliefIsHoweverManyAreSentAtOnce) {
  const belief::Scene scene = scene_of_three();
  const TrackState states[] = {TrackState::kTracked, TrackState::kDoubtful, TrackState::kUnseen, TrackState::kLost};
  for (const std::size_t at_once : {std::size_t{1}, std::size_t{2}, std::size_t{100}}) {
    core::RandomStream stream(5, core::Purpose::kTest);
    const PlanningSceneSettings settings{.supports = stream.uniform_below(2) == 0, .most_at_once = at_once};
    PlanningScene planning(settings);
    World world;
    BeliefSummary summary = summary_of_scene(scene);
    for (int round = 0; round < 200; ++round) {
      for (ObjectSummary& object : summary.objects) {
        object.state = states[stream.uniform_below(4)];
        if (stream.uniform_below(2) == 0) continue;
        const double angle = 0.01 * stream.normal();
        const double z = stream.normal(), y = stream.normal(), x = stream.normal();
        object.X_WO = {tests::about({1.0, 2.0, 3.0}, angle), geometry::Vector3d(x, y, z) * 0.01};
      }
      for (int step = 0; step < 8; ++step) {
        const auto messages = told(planning, summary, scene);
        EXPECT_LE(messages.size(), at_once);
        for (const RosCollisionObject& message : messages) world.take(message);
      }
      EXPECT_TRUE(told(planning, summary, scene).empty()) << "all was said";
      std::size_t present = settings.supports ? scene.supports.size() : 0;
      for (const ObjectSummary& object : summary.objects) {
        if (object.state == TrackState::kLost) continue;
        ++present;
        const auto placed = world.poses.find("prescene/" + object.name);
        ASSERT_NE(placed, world.poses.end()) << object.name;
        EXPECT_LE(distance(placed->second, object.X_WO), settings.moved);
      }
      EXPECT_EQ(world.poses.size(), present);
    }
  }
}

TEST(PlanningScene, SendsNothingWithoutReadersAndAllToANewOne) {
  const belief::Scene scene = scene_of_three();
  PlanningScene planning({.supports = true, .most_at_once = 100});
  BeliefSummary summary = summary_of_scene(scene);
  EXPECT_TRUE(told(planning, summary, scene, {0, 0}).empty());
  EXPECT_EQ(told(planning, summary, scene, {1, 1}).size(), scene.objects.size() + scene.supports.size());
  EXPECT_TRUE(told(planning, summary, scene, {1, 1}).empty());
  // What is lost in the step in which another reader comes is gone for the first one, too.
  summary.objects[0].state = TrackState::kLost;
  const auto anew = told(planning, summary, scene, {2, 2});
  std::map<std::uint8_t, int> operations;
  for (const RosCollisionObject& message : anew) ++operations[message.operation];
  EXPECT_EQ(operations[static_cast<std::uint8_t>(RosCollisionOperation::kRemove)], 1);
  EXPECT_EQ(operations[static_cast<std::uint8_t>(RosCollisionOperation::kAdd)],
            static_cast<int>(scene.objects.size() + scene.supports.size()) - 1);
  EXPECT_TRUE(told(planning, summary, scene, {1, 2}).empty()) << "one left";
  EXPECT_EQ(told(planning, summary, scene, {1, 3}).size(), scene.objects.size() + scene.supports.size() - 1)
      << "one left and another came between two steps";
}

TEST(PlanningScene, LeavesWhatAHandHoldsToItsClientAndAddsItWhenReleased) {
  const belief::Scene scene = scene_of_three();
  PlanningScene planning(kAllAtOnce);
  BeliefSummary summary = summary_of_scene(scene);
  EXPECT_EQ(told(planning, summary, scene).size(), 3U);
  summary.objects[1].held_by = "hand";
  for (int i = 0; i < 3; ++i) {
    summary.objects[1].X_WO.translation.z() += 0.1;
    EXPECT_TRUE(told(planning, summary, scene).empty());
  }
  summary.objects[1].held_by.reset();
  const auto released = told(planning, summary, scene);
  ASSERT_EQ(words(released), Words{"add " + summary.objects[1].name});
  EXPECT_DOUBLE_EQ(released[0].pose.position.z, summary.objects[1].X_WO.translation.z());
}

TEST(PlanningScene, AddsWhatIsHeldOnceForANewReader) {
  const belief::Scene scene = scene_of_three();
  PlanningScene planning(kAllAtOnce);
  BeliefSummary summary = summary_of_scene(scene);
  EXPECT_EQ(told(planning, summary, scene).size(), 3U);
  summary.objects[1].held_by = "hand";
  EXPECT_TRUE(told(planning, summary, scene).empty());
  EXPECT_EQ(told(planning, summary, scene, {2, 2}).size(), 3U);
  EXPECT_TRUE(told(planning, summary, scene, {2, 2}).empty());
  summary.objects[1].held_by.reset();
  EXPECT_EQ(words(told(planning, summary, scene, {2, 2})), Words{"add " + summary.objects[1].name});
}

TEST(PlanningScene, DoesNotAddWhatIsFoundAgainInTheHand) {
  const belief::Scene scene = scene_of_three();
  for (const bool lost_in_hand : {true, false}) {
    PlanningScene planning(kAllAtOnce);
    BeliefSummary summary = summary_of_scene(scene);
    ObjectSummary& object = summary.objects[1];
    EXPECT_EQ(told(planning, summary, scene).size(), 3U);
    object.held_by = "hand";
    EXPECT_TRUE(told(planning, summary, scene).empty());
    object.state = TrackState::kLost;
    if (!lost_in_hand) object.held_by.reset();  // the loss took the hold with it
    EXPECT_EQ(words(told(planning, summary, scene)), Words{"remove " + object.name});
    EXPECT_TRUE(told(planning, summary, scene).empty());
    object.state = TrackState::kTracked;
    object.held_by = "hand";
    EXPECT_TRUE(told(planning, summary, scene).empty());
    object.held_by.reset();
    EXPECT_EQ(words(told(planning, summary, scene)), Words{"add " + object.name});
  }
}

TEST(PlanningScene, ThingsThatMoveTakeTurnsAfterThoseThatAreNew) {
  const belief::Scene scene = scene_of_three();
  PlanningScene planning;
  BeliefSummary summary = summary_of_scene(scene);
  ObjectSummary last = summary.objects.back();
  summary.objects.pop_back();
  const auto step = [&] {
    for (ObjectSummary& object : summary.objects) object.X_WO.translation.x() += 0.1;
    return words(told(planning, summary, scene));
  };
  std::map<std::string, int> counts;
  for (int i = 0; i < 12; ++i) {
    const Words said = step();
    ASSERT_EQ(said.size(), 1U);
    ++counts[said[0]];
  }
  for (const ObjectSummary& object : summary.objects) {
    EXPECT_EQ(counts["add " + object.name], 1);
    EXPECT_EQ(counts["move " + object.name], 5);
  }
  summary.objects.push_back(last);
  EXPECT_EQ(step(), Words{"add " + last.name});
}

TEST(PlanningScene, RepeatsOneThingASecondInTurnAndRemovalsOnce) {
  const belief::Scene scene = scene_of_three();
  PlanningScene planning;
  BeliefSummary summary = summary_of_scene(scene);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(told(planning, summary, scene).size(), 1U);
  EXPECT_TRUE(told(planning, summary, scene).empty());
  const auto next_second = [&] {
    summary.stamp_ns += kSecond;
    Words said = words(told(planning, summary, scene));
    EXPECT_TRUE(told(planning, summary, scene).empty());
    return said;
  };
  std::map<std::string, int> counts;
  for (int i = 0; i < 6; ++i)
    for (const std::string& word : next_second()) ++counts[word];
  ASSERT_EQ(counts.size(), 3U);
  for (const ObjectSummary& object : summary.objects) EXPECT_EQ(counts["add " + object.name], 2);

  ObjectSummary& object = summary.objects[0];
  const std::string removal = "remove " + object.name;
  object.state = TrackState::kLost;
  EXPECT_EQ(words(told(planning, summary, scene)), Words{removal});
  EXPECT_EQ(next_second(), Words{removal});
  counts.clear();
  summary.objects[1].held_by = "hand";
  for (int i = 0; i < 4; ++i)
    for (const std::string& word : next_second()) ++counts[word];
  EXPECT_EQ(counts, (std::map<std::string, int>{{"add " + summary.objects[2].name, 4}})) << "not what is held";
}

TEST(PlanningScene, WhatCouldNotBeSentIsDueAgain) {
  const belief::Scene scene = scene_of_three();
  PlanningScene planning(kAllAtOnce);
  BeliefSummary summary = summary_of_scene(scene);
  int tries = 0;
  const auto fail = [&] {
    planning.tell(summary, scene, "map", kOne, [&](const RosCollisionObject&) {
      ++tries;
      return false;
    });
  };
  fail();
  EXPECT_EQ(std::exchange(tries, 0), 1) << "what follows waits, too";
  EXPECT_EQ(told(planning, summary, scene).size(), 3U);
  ObjectSummary& object = summary.objects[0];
  object.X_WO.translation.x() += 1.0;
  fail();
  EXPECT_EQ(words(told(planning, summary, scene)), Words{"move " + object.name});
  object.state = TrackState::kLost;
  fail();
  EXPECT_EQ(words(told(planning, summary, scene)), Words{"remove " + object.name});
  EXPECT_EQ(tries, 2);
}

TEST(PlanningScene, ShapesMadeBeforehandAreThoseOfTheModels) {
  belief::Scene scene = scene_of_three();
  PlanningScene planning(kAllAtOnce);
  planning.prepare(scene);
  BeliefSummary summary = summary_of_scene(scene);
  EXPECT_EQ(told(planning, summary, scene).size(), 3U);
  // The model of an object that was found anew has another shape.
  const auto model = std::find_if(scene.models.begin(), scene.models.end(),
                                  [&](const belief::ObjectModel& m) { return m.name == summary.objects[1].model; });
  model->collision = {belief::PrimitiveShape{geometry::Sphere{0.25}, {}}};
  const auto changed = told(planning, summary, scene);
  ASSERT_EQ(words(changed), Words{"add " + summary.objects[1].name});
  ASSERT_EQ(changed[0].primitives.size(), 1U);
  EXPECT_EQ(changed[0].primitives[0].dimensions, std::vector<double>{0.25});
  EXPECT_TRUE(told(planning, summary, scene).empty());
}

TEST(CollisionObjectOf, HasTheBoundsOfTheShapes) {
  const geometry::Pose X_OS{tests::about({0.0, 0.0, 1.0}, 0.3), {0.1, 0.2, 0.3}};
  const auto one = [&](const geometry::Primitive& primitive) {
    return collision_object_of({belief::PrimitiveShape{primitive, X_OS}}, 1000);
  };
  using Dimensions = std::vector<double>;
  const std::pair<geometry::Primitive, Dimensions> solids[] = {{geometry::Sphere{0.4}, {0.4}},
                                                               {geometry::BoxShape{{0.1, 0.2, 0.3}}, {0.1, 0.2, 0.3}},
                                                               {geometry::Cylinder{0.05, 0.2}, {0.2, 0.05}},
                                                               {geometry::Cone{0.05, 0.2}, {0.2, 0.05}}};
  std::uint8_t type = 0;
  for (const auto& [primitive, dimensions] : solids) {
    SCOPED_TRACE(dimensions.size());
    const RosCollisionObject object = one(primitive);
    ASSERT_EQ(object.primitives.size(), 1U);
    EXPECT_NE(object.primitives[0].type, std::exchange(type, object.primitives[0].type));
    EXPECT_EQ(object.primitives[0].dimensions, dimensions);
    EXPECT_EQ(object.primitive_poses, std::vector{interfaces::to_ros_pose(X_OS)});
  }
  const belief::PrimitiveShape pill{geometry::Capsule{0.05, 0.2}, X_OS};
  const RosCollisionObject object = collision_object_of({pill}, 200);
  ASSERT_EQ(object.meshes.size(), 1U);
  EXPECT_LE(object.meshes[0].triangles.size(), 200U);
  geometry::TriangleMesh mesh;
  for (const interfaces::RosPoint& p : object.meshes[0].vertices) mesh.vertices.emplace_back(p.x, p.y, p.z);
  for (const interfaces::RosMeshTriangle& triangle : object.meshes[0].triangles)
    for (const std::uint32_t corner : triangle.vertex_indices) EXPECT_LT(corner, mesh.vertices.size());
  const geometry::Box expected =
      geometry::bounding_box(belief::collision_mesh(std::vector<belief::CollisionShape>{pill}));
  const geometry::Box found = geometry::bounding_box(mesh);
  EXPECT_LT((found.min() - expected.min()).norm(), 0.01);
  EXPECT_LT((found.max() - expected.max()).norm(), 0.01);
}

}  // namespace
}  // namespace prescene::service::planning_scene_test
