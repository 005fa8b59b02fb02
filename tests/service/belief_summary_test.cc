// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/belief_summary.h"

#include <gmock/gmock.h>

#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "prescene/belief/json.h"
#include "prescene/interfaces/ros_messages/conversions.h"
#include "tests/support/simple_scenes.h"

namespace prescene::service {
namespace {

using interfaces::RosMarker;
using interfaces::RosMarkerAction;
using MarkerKey = std::pair<std::string, std::int32_t>;

belief::Scene box_on_floor() {
  return tests::floor_scene(tests::primitive_model("box", geometry::BoxShape{{0.05, 0.05, 0.1}}));
}

/// The first object of a scene, with where else it may be.
BeliefSummary summary_with(const belief::Scene& scene, std::vector<belief::AlternativePose> alternatives) {
  ObjectSummary object;
  object.name = scene.objects[0].name;
  object.model = scene.model_of(scene.objects[0]).name;
  object.confidence = 0.7;
  object.parameters = {{"friction", 0.4, 0.1, 0.2, 0.6}, {"mass", 0.3, 0.02, 0.27, 0.33}};
  object.alternatives = std::move(alternatives);
  return {3, 1'000, {object}};
}

std::map<MarkerKey, RosMarker> by_key(const interfaces::RosMarkerArray& array) {
  std::map<MarkerKey, RosMarker> markers;
  for (const RosMarker& marker : array.markers)
    EXPECT_TRUE(markers.emplace(MarkerKey{marker.ns, marker.id}, marker).second);
  return markers;
}

bool is_added(const RosMarker& marker) { return marker.action == static_cast<std::int32_t>(RosMarkerAction::kAdd); }

TEST(BeliefSummary, IsTheSameAfterJson) {
  const belief::Scene scene = box_on_floor();
  const BeliefSummary summary = summary_with(scene, {{geometry::Pose::from_translation({0.1, 0.2, 0.3}), 0.2}});
  const auto read = belief_summary_from_json(belief::json_text(to_json(summary)));
  ASSERT_TRUE(read.ok()) << read.status().message();
  EXPECT_EQ(belief::json_text(to_json(*read)), belief::json_text(to_json(summary)));
  EXPECT_EQ(read->objects[0].parameters.size(), 2U);
  EXPECT_EQ(read->objects[0].alternatives, summary.objects[0].alternatives);
}

TEST(BeliefSummary, TellsMotionAndHandAfterJson) {
  const belief::Scene scene = box_on_floor();
  BeliefSummary summary = summary_with(scene, {});
  for (const belief::MotionMode motion :
       {belief::MotionMode::kResting, belief::MotionMode::kHeld, belief::MotionMode::kMoving}) {
    summary.objects[0].motion = motion;
    summary.objects[0].held_by =
        motion == belief::MotionMode::kHeld ? std::optional<std::string>("hand") : std::nullopt;
    const auto read = belief_summary_from_json(belief::json_text(to_json(summary)));
    ASSERT_TRUE(read.ok()) << read.status().message();
    EXPECT_EQ(read->objects[0].motion, motion);
    EXPECT_EQ(read->objects[0].held_by, summary.objects[0].held_by);
  }
}

TEST(PosesOf, AreThoseOfDetectionsInTheirOrder) {
  const belief::Scene scene = box_on_floor();
  BeliefSummary summary = summary_with(scene, {});
  for (int i = 0; i < 4; ++i) {
    summary.objects.push_back(summary.objects[0]);
    summary.objects.back().name += std::to_string(i);
    summary.objects.back().X_WO = geometry::Pose::from_translation({0.1 * i, 0.2, 0.3});
    summary.objects.back().state = i % 2 == 0 ? belief::TrackState::kLost : belief::TrackState::kUnseen;
  }
  const auto poses = poses_of(summary, "map");
  const auto detections = detections_of(summary, scene, "map");
  EXPECT_EQ(poses.header, detections.header);
  ASSERT_EQ(poses.poses.size(), detections.detections.size());
  EXPECT_EQ(poses.poses.size(), 3U);
  for (std::size_t i = 0; i < poses.poses.size(); ++i)
    EXPECT_EQ(poses.poses[i], detections.detections[i].results.at(0).pose.pose);
}

TEST(MarkersOf, DrawGhostsWhereAnObjectMayBeAndRemoveThemAfterwards) {
  const belief::Scene scene = box_on_floor();
  const MarkerMeshes meshes = marker_meshes(scene);
  const geometry::Pose X_WO = geometry::Pose::from_translation({0.1, 0.2, 0.3});
  const auto with = by_key(markers_of(summary_with(scene, {{X_WO, 0.3}}), scene, meshes, "map"));
  const auto without = by_key(markers_of(summary_with(scene, {}), scene, meshes, "map"));
  int ghosts = 0;
  for (const auto& [key, marker] : with) {
    ASSERT_TRUE(without.contains(key)) << "what was drawn is drawn or removed";
    if (key.first != "prescene/alternatives" || !is_added(marker)) continue;
    ++ghosts;
    EXPECT_EQ(marker.pose.position.x, 0.1);
    EXPECT_FALSE(marker.points.empty());
    EXPECT_LT(marker.color.a, 0.5F);
    EXPECT_FALSE(is_added(without.at(key)));
  }
  EXPECT_EQ(ghosts, 1);
}

TEST(MarkersOf, RemoveAllOfWhatIsLost) {
  const belief::Scene scene = box_on_floor();
  BeliefSummary summary = summary_with(scene, {{geometry::Pose::identity(), 0.3}});
  summary.objects[0].state = belief::TrackState::kLost;
  for (const auto& [key, marker] : by_key(markers_of(summary, scene, marker_meshes(scene), "map")))
    EXPECT_FALSE(is_added(marker)) << key.first << " " << key.second;
}

}  // namespace
}  // namespace prescene::service
