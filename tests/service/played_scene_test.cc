// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/recording/played_scene.h"

#include <gtest/gtest.h>

#include <map>
#include <string>
#include <vector>

#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/interfaces/ros_messages/conversions.h"
#include "prescene/service/backends.h"
#include "prescene/service/load_scene.h"
#include "tests/service/recorded_box.h"
#include "tests/support/paths.h"

namespace prescene::service {
namespace {

constexpr double kFrameInterval = 0.1;

constexpr const char* kPushedAndHeld = R"(
duration: 1.0
models:
  block: {box: [0.05, 0.05, 0.05], mass: 0.2, friction: 0.5}
supports:
  table: {box: [1, 1, 0.04], pose: {position: [0, 0, -0.02]}}
robot:
  hand:
    box: [0.05, 0.05, 0.02]
    timeline: [{time: 0, position: [0.2, 0, 0.3]}, {time: 1, position: [0.2, 0.2, 0.3]}]
objects:
  left: {model: block, pose: {position: [-0.2, 0, 0.025]}}
  held: {model: block, held_by: hand, pose: {position: [0.2, 0, 0.26]}}
actions:
  - {time: 0.2, push: {from: [-0.3, 0, 0.02], to: [-0.2, 0, 0.02], duration: 0.6}}
  - {time: 0.4, release: {object: held}}
)";

class PlayedSceneTest : public testing::Test {
 protected:
  void SetUp() override {
    const auto loaded = load_scene_text(kPushedAndHeld, "made.yaml", {});
    ASSERT_TRUE(loaded.ok()) << loaded.status().message();
    scene_ = *loaded;
  }

  core::Result<std::vector<PlayedPart>> play(std::vector<UnannouncedChange> changes) {
    return play_scene(*scene_, std::move(changes), backends_.simulator_factory(), kFrameInterval, 1, pool_);
  }

  core::ThreadPool pool_{1};
  Backends backends_{pool_};
  std::shared_ptr<const belief::Scene> scene_;
};

TEST_F(PlayedSceneTest, IsOneTrajectoryWithoutChanges) {
  const auto parts = play({});
  ASSERT_TRUE(parts.ok()) << parts.status().message();
  ASSERT_EQ(parts->size(), 1u);
  EXPECT_EQ((*parts)[0].trajectory.states.size(), 11u);
  EXPECT_TRUE((*parts)[0].scene == *scene_);
}

TEST_F(PlayedSceneTest, StatesFollowEachOtherAcrossChanges) {
  const auto parts =
      play({{0.31, "left", std::nullopt}, {0.62, "left", geometry::Pose::from_translation({0.0, 0.3, 0.025})}});
  ASSERT_TRUE(parts.ok()) << parts.status().message();
  ASSERT_EQ(parts->size(), 3u);
  std::vector<double> times;
  for (const PlayedPart& part : *parts)
    for (const belief::WorldState& state : part.trajectory.states) {
      times.push_back(state.time);
      EXPECT_EQ(state.objects.size(), part.scene.objects.size());
    }
  ASSERT_EQ(times.size(), 11u);
  for (std::size_t i = 0; i < times.size(); ++i) EXPECT_NEAR(times[i], kFrameInterval * static_cast<double>(i), 3e-3);
  EXPECT_EQ((*parts)[1].scene.objects.size(), 1u);
  EXPECT_EQ((*parts)[1].scene.objects[0].name, "held");
  const belief::WorldState& put = (*parts)[2].trajectory.states.front();
  EXPECT_EQ((*parts)[2].scene.objects[0].name, "left");
  EXPECT_EQ(put.objects[0].X_WO.translation, geometry::Vector3d(0.0, 0.3, 0.025));
}

TEST_F(PlayedSceneTest, WhatAChangeDoesNotTouchGoesOnAsWithoutIt) {
  // The held block moves with the hand, is let go at 0.4 s and falls beside the change of the other one.
  const auto whole = play({});
  const auto changed =
      play({{0.2, "left", std::nullopt}, {0.6, "left", geometry::Pose::from_translation({0, 0.3, 0.025})}});
  ASSERT_TRUE(whole.ok() && changed.ok());
  std::vector<geometry::Pose> poses;
  for (const PlayedPart& part : *changed)
    for (const belief::WorldState& state : part.trajectory.states)
      poses.push_back(state.objects[static_cast<std::size_t>(*belief::find_object(part.scene, "held"))].X_WO);
  const auto& states = (*whole)[0].trajectory.states;
  ASSERT_EQ(poses.size(), states.size());
  for (std::size_t i = 0; i < states.size(); ++i)
    EXPECT_LT((poses[i].translation - states[i].objects[1].X_WO.translation).norm(), 2e-3) << i;
  EXPECT_LT(poses.back().translation.z(), 0.05);
}

// Cameras see the hands where robot_pose_in() has them, and the robot reports these places: they are the simulator's,
// in which what a hand grasped does not move.
TEST_F(PlayedSceneTest, WhatIsGraspedStaysWhereItIsInTheHandThatIsShown) {
  belief::Scene scene = *scene_;
  scene.robot[0].timeline.resize(1);
  scene.objects[1].held_by.reset();
  geometry::Pose turned = geometry::Pose::from_translation({0.1, 0.2, 0.4});
  turned.rotation = geometry::exp_rotation({0.3, -0.5, 0.9});
  scene.actions = {
      {0.0, belief::Grasp{"held", "hand", {}}},
      {0.1, belief::Transport{"held", belief::FixedPose{turned}, 0.2}},
      {0.5, belief::Transport{"held", belief::FixedPose{geometry::Pose::from_translation({0, 0, 0.3})}, 0.3}}};
  ASSERT_TRUE(belief::validate(scene).ok());
  const geometry::Pose X_GO = belief::pose_at(scene.robot[0], 0.0).inverse() * belief::mean(scene.objects[1].pose);
  for (const std::vector<UnannouncedChange>& changes :
       {std::vector<UnannouncedChange>{}, std::vector<UnannouncedChange>{{0.4, "left", std::nullopt}}}) {
    const auto parts = play_scene(scene, changes, backends_.simulator_factory(), kFrameInterval, 1, pool_);
    ASSERT_TRUE(parts.ok()) << parts.status().message();
    for (const PlayedPart& part : *parts)
      for (const belief::WorldState& state : part.trajectory.states) {
        const auto held = static_cast<std::size_t>(*belief::find_object(part.scene, "held"));
        const geometry::Pose X_WG = robot_pose_in(*parts, 0, state.time);
        EXPECT_LT(geometry::box_minus(X_WG.inverse() * state.objects[held].X_WO, X_GO).norm(), 1e-3) << state.time;
      }
    EXPECT_LT((parts->back().trajectory.final().objects[changes.empty() ? 1 : 0].X_WO.translation -
               geometry::Vector3d(0, 0, 0.3))
                  .norm(),
              1e-3);
  }
}

// Where things are at the start and where they are to go is drawn, and what was let go of lies where it fell.
TEST_F(PlayedSceneTest, WhatIsHeldKeepsItsDrawnGraspInTheHandThatIsShown) {
  belief::Scene scene = *scene_;
  scene.duration = 1.4;
  scene.robot[0].timeline[1].time = 0.2;  // it moves before it carries
  geometry::Matrix6d spread = geometry::Matrix6d::Zero();
  spread.diagonal() << 0.01, 0.01, 0.01, 1e-4, 1e-4, 1e-6;
  const geometry::Pose mean_start = geometry::Pose::from_translation({0.2, 0.0, 0.26});
  scene.objects[1].pose = belief::NormalPose{mean_start, spread};
  geometry::Matrix6d goal_spread = geometry::Matrix6d::Zero();
  goal_spread.diagonal() << 1e-4, 1e-4, 0.01, 1e-4, 1e-4, 0.0;
  const belief::NormalPose low{geometry::Pose::from_translation({0.2, 0.1, 0.032}), goal_spread};
  const belief::FixedPose high{geometry::Pose::from_translation({0.1, 0.1, 0.3})};
  // It is taken between two frames and lifted before the next one, or after it. A way begins at a whole step.
  for (const double lifted : {0.95, 1.025}) {
    scene.actions = {{0.1, belief::Transport{"held", low, 0.2}},
                     {0.35, belief::Release{"held", {0.0, 0.0, 0.1}, 0.05, {}}},
                     {0.92, belief::Grasp{"held", "hand", {}}},
                     {lifted, belief::Transport{"held", high, 0.15}}};
    ASSERT_TRUE(belief::validate(scene).ok());
    for (const std::vector<UnannouncedChange>& changes :
         {std::vector<UnannouncedChange>{}, std::vector<UnannouncedChange>{{0.3, "left", std::nullopt}},
          std::vector<UnannouncedChange>{{0.1, "left", std::nullopt}, {0.6, "left", mean_start}}}) {
      const auto parts = play_scene(scene, changes, backends_.simulator_factory(), kFrameInterval, 1, pool_);
      ASSERT_TRUE(parts.ok()) << parts.status().message();
      std::vector<geometry::Pose> first, second;  // X_GO of both times that it is held
      for (const PlayedPart& part : *parts)
        for (const belief::WorldState& state : part.trajectory.states) {
          const auto held = static_cast<std::size_t>(*belief::find_object(part.scene, "held"));
          const geometry::Pose X_GO = robot_pose_in(*parts, 0, state.time).inverse() * state.objects[held].X_WO;
          if (state.time < 0.34) first.push_back(X_GO);
          if (state.time > 0.95) second.push_back(X_GO);
        }
      ASSERT_EQ(first.size(), 4u);
      ASSERT_EQ(second.size(), 5u);
      const geometry::Pose X_GO_mean = belief::pose_at(scene.robot[0], 0.0).inverse() * mean_start;
      EXPECT_GT(geometry::box_minus(first[0], X_GO_mean).norm(), 0.02);
      for (const geometry::Pose& X_GO : first) EXPECT_LT(geometry::box_minus(X_GO, first[0]).norm(), 1e-3);
      EXPECT_GT((second[0].translation - first[0].translation).norm(), 0.05);  // the hand had backed off
      for (const geometry::Pose& X_GO : second) EXPECT_LT(geometry::box_minus(X_GO, second.back()).norm(), 1e-3);
      const belief::WorldState& end = parts->back().trajectory.final();
      EXPECT_LT(
          (end.objects[static_cast<std::size_t>(*belief::find_object(parts->back().scene, "held"))].X_WO.translation -
           high.X_WO.translation)
              .norm(),
          1e-3);
    }
  }
}

// The robot's own words and the truth that are in one recording.
TEST_F(PlayedSceneTest, TheHandThatARecordingReportsKeepsItsDrawnGrasp) {
  const std::string scene = R"(
name: carried
duration: 1.0
models:
  box: {box: [0.1, 0.1, 0.1], mass: 0.4}
supports:
  table: {box: [0.8, 0.8, 0.04], pose: {position: [0, 0, -0.02]}}
robot:
  hand: {box: [0.05, 0.05, 0.02], pose: {position: [0, 0, 0.3]}}
objects:
  box:
    model: box
    held_by: hand
    pose: {position: [0, 0, 0.23], normal: {position: [0.01, 0.01, 0.01], rotation_deg: [5, 5, 5]}}
actions:
  - time: 0.2
    transport:
      object: box
      pose: {position: [0.1, 0.1, 0.2], rotation: {euler_deg: [0, 0, 40]}}
      duration: 0.5
camera:
  width: 80
  height: 60
  fov_deg: 55
  look: {from: [0.55, -0.5, 0.5], at: [0, 0, 0.2]}
)";
  const tests::ScratchDir folder;
  const auto path = folder.path() / "carried.mcap";
  const core::Status recorded = tests::record_scene(scene, {}, 10.0, path);
  ASSERT_TRUE(recorded.ok()) << recorded.message();
  const auto reader = RecordingReader::open(path);
  ASSERT_TRUE(reader.ok()) << reader.status().message();
  std::map<core::TimeNs, geometry::Pose> hand, box;
  for (;;) {
    const auto entry = (*reader)->next();
    ASSERT_TRUE(entry.ok());
    if (!*entry) break;
    const interfaces::ReceivedMessage& message = (*entry)->message;
    if (message.topic == kTruthTopic) {
      const auto record = truth_from_json(std::string(message.cdr.begin(), message.cdr.end()));
      ASSERT_TRUE(record.ok());
      box[record->stamp_ns] = record->objects.at(0).X_WO;
    } else if (message.topic == InputTopics{}.tf) {
      const auto tf = interfaces::decode_cdr<interfaces::RosTfMessage>(message.cdr);
      ASSERT_TRUE(tf.ok());
      const auto transforms = interfaces::to_transforms(*tf);
      ASSERT_TRUE(transforms.ok());
      hand[transforms->accepted.at(0).stamp_ns] = transforms->accepted.at(0).X_PC;
    }
  }
  ASSERT_EQ(box.size(), 11u);
  const geometry::Pose X_GO = hand.begin()->second.inverse() * box.begin()->second;
  for (const auto& [stamp_ns, X_WO] : box) {
    const auto then = hand.lower_bound(stamp_ns - 1000);
    ASSERT_TRUE(then != hand.end() && then->first <= stamp_ns + 1000) << stamp_ns;
    EXPECT_LT(geometry::box_minus(then->second.inverse() * X_WO, X_GO).norm(), 1e-3) << stamp_ns;
  }
}

// What it backs off by when it lets go of one thing is no part of where it takes the next.
TEST_F(PlayedSceneTest, AHandThatBackedOffTakesTheNextThingToItsGoal) {
  belief::Scene scene = *scene_;
  scene.robot[0].timeline.resize(1);
  const geometry::Vector3d goal(-0.2, 0.1, 0.2);
  scene.actions = {{0.1, belief::Release{"held", {0.0, 0.0, 0.2}, 0.1, {}}},
                   {0.3, belief::Grasp{"left", "hand", {}}},
                   {0.4, belief::Transport{"left", belief::FixedPose{geometry::Pose::from_translation(goal)}, 0.3}}};
  ASSERT_TRUE(belief::validate(scene).ok());
  const auto parts = play_scene(scene, {}, backends_.simulator_factory(), kFrameInterval, 1, pool_);
  ASSERT_TRUE(parts.ok()) << parts.status().message();
  const belief::WorldState& end = parts->back().trajectory.final();
  EXPECT_LT((end.objects[0].X_WO.translation - goal).norm(), 1e-3);
  const geometry::Vector3d grasped_from = belief::mean(scene.objects[0].pose).translation;
  const geometry::Vector3d moved =
      robot_pose_in(*parts, 0, end.time).translation - robot_pose_in(*parts, 0, 0.3).translation;
  EXPECT_LT((moved - (goal - grasped_from)).norm(), 1e-3);
}

TEST_F(PlayedSceneTest, APushUnderWayGoesOn) {
  const auto whole = play({});
  const auto changed = play({{0.5, "held", std::nullopt}});
  ASSERT_TRUE(whole.ok() && changed.ok());
  const geometry::Vector3d end = (*whole)[0].trajectory.final().objects[0].X_WO.translation;
  EXPECT_GT(end.x(), -0.19);  // it was pushed at all
  EXPECT_LT((changed->back().trajectory.final().objects[0].X_WO.translation - end).norm(), 2e-3);
}

TEST_F(PlayedSceneTest, WhatIsNotThereFromTheStartMayBePutIn) {
  const auto parts =
      play({{0.0, "left", std::nullopt}, {0.5, "left", geometry::Pose::from_translation({-0.2, 0.1, 0.025})}});
  ASSERT_TRUE(parts.ok()) << parts.status().message();
  EXPECT_EQ(parts->front().scene.objects.size(), 1u);
  EXPECT_EQ(parts->back().scene.objects.size(), 2u);
}

// The nearest frame is then behind the scene's end.
TEST_F(PlayedSceneTest, AChangeAtTheEndIsAtTheEnd) {
  belief::Scene longer = *scene_;
  longer.duration = 1.07;
  const auto parts =
      play_scene(longer, {{1.07, "left", std::nullopt}}, backends_.simulator_factory(), kFrameInterval, 1, pool_);
  ASSERT_TRUE(parts.ok()) << parts.status().message();
  ASSERT_EQ(parts->size(), 2u);
  EXPECT_EQ(parts->back().scene.objects.size(), 1u);
  ASSERT_EQ(parts->back().trajectory.states.size(), 1u);
  EXPECT_DOUBLE_EQ(parts->back().trajectory.states[0].time, 1.07);
}

// 0.3 is not 3 * 0.1 in binary: the release would count as one from before.
TEST_F(PlayedSceneTest, AnActionAtTheFrameOfAChangeIsNotLost) {
  belief::Scene scene = *scene_;
  ASSERT_LT(0.3, 3 * kFrameInterval);
  scene.actions = {{0.3, belief::Release{"held"}}};
  const auto parts =
      play_scene(scene, {{0.3, "left", std::nullopt}}, backends_.simulator_factory(), kFrameInterval, 1, pool_);
  ASSERT_TRUE(parts.ok()) << parts.status().message();
  EXPECT_LT(parts->back().trajectory.final().objects[0].X_WO.translation.z(), 0.05);
}

TEST_F(PlayedSceneTest, RefusesAChangeWhoseFrameIsWithinAnAction) {
  belief::Scene scene = *scene_;
  scene.actions = {{0.34, belief::Transport{"held", belief::FixedPose{{}}, 0.3}}};
  for (const double time : {0.35, 0.4, 0.63}) {
    const auto parts =
        play_scene(scene, {{time, "left", std::nullopt}}, backends_.simulator_factory(), kFrameInterval, 1, pool_);
    EXPECT_EQ(parts.status().code(), core::StatusCode::kInvalidInput) << time;
  }
  scene.actions[0].time = 0.36;  // 0.36 is before it, but its frame, 0.4, is not
  EXPECT_EQ(play_scene(scene, {{0.36, "left", std::nullopt}}, backends_.simulator_factory(), kFrameInterval, 1, pool_)
                .status()
                .code(),
            core::StatusCode::kInvalidInput);
}

TEST_F(PlayedSceneTest, RefusesWhatCannotBe) {
  const auto fails_with = [&](std::vector<UnannouncedChange> changes, const std::string& part) {
    const auto parts = play(std::move(changes));
    ASSERT_FALSE(parts.ok());
    EXPECT_EQ(parts.status().code(), core::StatusCode::kInvalidInput);
    EXPECT_NE(parts.status().message().find(part), std::string::npos) << parts.status().message();
  };
  fails_with({{0.5, "cup", std::nullopt}}, "has no object of that name");
  fails_with({{1.5, "left", std::nullopt}}, "outside the scene's duration");
  fails_with({{-0.1, "left", std::nullopt}}, "outside the scene's duration");
  for (const double far : {2e4, -1e300})
    fails_with({{0.5, "left", geometry::Pose::from_translation({0.0, far, 0.0})}}, "its place is out of range");
}

TEST(UnannouncedChanges, AreReadFromText) {
  const auto removal = removal_from_text("1.5:cup");
  ASSERT_TRUE(removal.ok());
  EXPECT_EQ(removal->time, 1.5);
  EXPECT_EQ(removal->object, "cup");
  EXPECT_FALSE(removal->X_WO);
  const auto put = put_from_text("0.5:cup:0.1,-0.2,0.3,90");
  ASSERT_TRUE(put.ok());
  EXPECT_EQ(put->X_WO->translation, geometry::Vector3d(0.1, -0.2, 0.3));
  EXPECT_NEAR((put->X_WO->rotation * geometry::Vector3d::UnitX() - geometry::Vector3d::UnitY()).norm(), 0.0, 1e-12);
  for (const char* text : {"", ":", "cup", "1.5", "1.5:", "x:cup", "1:cup:0,0,0", "inf:cup"})
    EXPECT_FALSE(removal_from_text(text).ok()) << text;
  for (const char* text :
       {"", "1:cup", "1:cup:", "1:cup:0,0", "1:cup:0,0,0,0,0", "1:cup:0,0,x", "1::0,0,0", "1:cup:nan,0,0"})
    EXPECT_FALSE(put_from_text(text).ok()) << text;
}

TEST_F(PlayedSceneTest, IsStoppedOnRequest) {
  core::Cancellation stop;
  stop.request();
  for (const std::vector<UnannouncedChange>& changes :
       {std::vector<UnannouncedChange>{}, std::vector<UnannouncedChange>{{0.5, "left", std::nullopt}}})
    EXPECT_EQ(
        play_scene(*scene_, changes, backends_.simulator_factory(), kFrameInterval, 1, pool_, &stop).status().code(),
        core::StatusCode::kCancelled);
}

TEST_F(PlayedSceneTest, ARecordingIsStoppedWhileWhatHappenedIsLookedAt) {
  const auto scene = load_scene_text(tests::box_on_table("0.3"), "made.yaml", {});
  ASSERT_TRUE(scene.ok()) << scene.status().message();
  const tests::ScratchDir folder;
  const auto recording = RecordingWriter::create(folder.path() / "stopped.mcap", {});
  ASSERT_TRUE(recording.ok()) << recording.status().message();
  core::Cancellation stop;
  // The last frame is followed by nothing but that.
  const auto at_the_end = [&](const core::Progress& progress) {
    if (progress.fraction >= 1.0) stop.request();
  };
  SimulatedRecordingOptions options;
  options.rate = 10.0;
  EXPECT_EQ(simulate_recording(**scene, options, 1, backends_, stop, at_the_end, **recording).code(),
            core::StatusCode::kCancelled);
}

}  // namespace
}  // namespace prescene::service
