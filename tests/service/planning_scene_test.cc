// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/live/planning_scene.h"

#include <gtest/gtest.h>

#include <map>
#include <string>
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
/// id, and one that is not there can be neither moved nor removed.
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
        EXPECT_EQ(poses.erase(message.id), 1U) << message.id;
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
        object.X_WO = {tests::about({1.0, 2.0, 3.0}, 0.01 * stream.normal()),
                       geometry::Vector3d(stream.normal(), stream.normal(), stream.normal()) * 0.01};
      }
      for (int step = 0; step < 8; ++step) {
        const auto messages = planning.changes(summary, scene, "map", 1);
        EXPECT_LE(messages.size(), at_once);
        for (const RosCollisionObject& message : messages) world.take(message);
      }
      EXPECT_TRUE(planning.changes(summary, scene, "map", 1).empty()) << "all was said";
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
  PlanningScene planning({.supports = true});
  BeliefSummary summary = summary_of_scene(scene);
  EXPECT_TRUE(planning.changes(summary, scene, "map", 0).empty());
  EXPECT_EQ(planning.changes(summary, scene, "map", 1).size(), scene.objects.size() + scene.supports.size());
  EXPECT_TRUE(planning.changes(summary, scene, "map", 1).empty());
  // What is lost in the step in which another reader comes is gone for the first one, too.
  summary.objects[0].state = TrackState::kLost;
  const auto anew = planning.changes(summary, scene, "map", 2);
  std::map<std::uint8_t, int> operations;
  for (const RosCollisionObject& message : anew) ++operations[message.operation];
  EXPECT_EQ(operations[static_cast<std::uint8_t>(RosCollisionOperation::kRemove)], 1);
  EXPECT_EQ(operations[static_cast<std::uint8_t>(RosCollisionOperation::kAdd)],
            static_cast<int>(scene.objects.size() + scene.supports.size()) - 1);
  EXPECT_TRUE(planning.changes(summary, scene, "map", 1).empty()) << "one left";
}

TEST(PlanningScene, LeavesWhatAHandHoldsToItsClientAndAddsItWhenReleased) {
  const belief::Scene scene = scene_of_three();
  PlanningScene planning;
  BeliefSummary summary = summary_of_scene(scene);
  EXPECT_EQ(planning.changes(summary, scene, "map", 1).size(), 3U);
  summary.objects[1].held_by = "hand";
  for (int i = 0; i < 3; ++i) {
    summary.objects[1].X_WO.translation.z() += 0.1;
    EXPECT_TRUE(planning.changes(summary, scene, "map", 1).empty());
  }
  summary.objects[1].held_by.reset();
  const auto released = planning.changes(summary, scene, "map", 1);
  ASSERT_EQ(released.size(), 1U);
  EXPECT_EQ(released[0].id, "prescene/" + summary.objects[1].name);
  EXPECT_EQ(released[0].operation, static_cast<std::uint8_t>(RosCollisionOperation::kAdd));
  EXPECT_DOUBLE_EQ(released[0].pose.position.z, summary.objects[1].X_WO.translation.z());
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
