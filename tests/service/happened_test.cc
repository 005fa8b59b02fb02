// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/recording/happened.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "prescene/service/backends.h"
#include "prescene/service/load_scene.h"

namespace prescene::service::happened_test {
namespace {

constexpr double kInterval = 1.0 / 240.0;

// The fingertip of 15 mm is at x = -0.24 when it touches the block's side at -0.225: after 0.6 of its way, at 0.56 s.
constexpr const char* kScene = R"(
duration: 1.0
models:
  block: {box: [0.05, 0.05, 0.05], mass: 0.2, friction: 0.5}
supports:
  table: {box: [1, 1, 0.04], pose: {position: [0, 0, -0.02]}}
robot:
  hand: {box: [0.05, 0.05, 0.02], pose: {position: [0.2, 0, 0.3]}}
objects:
  pushed: {model: block, pose: {position: [-0.2, 0, 0.025]}}
  held: {model: block, held_by: hand, pose: {position: [0.2, 0, 0.26]}}
  apart: {model: block, pose: {position: [0, 0.3, 0.025]}}
actions:
  - {time: 0.2, push: {from: [-0.3, 0, 0.02], to: [-0.2, 0, 0.02], duration: 0.6}}
  - {time: 0.4, release: {object: held}}
)";

class HappenedTest : public testing::Test {
 protected:
  HappenedRecord happened(const std::vector<UnannouncedChange>& changes, bool reported) {
    const auto scene = load_scene_text(kScene, "made.yaml", {});
    EXPECT_TRUE(scene.ok()) << scene.status().message();
    core::ThreadPool pool(1);
    Backends backends(pool);
    const auto parts = play_scene(**scene, changes, backends.simulator_factory(), kInterval, 1, pool);
    EXPECT_TRUE(parts.ok()) << parts.status().message();
    return happened_in(**scene, changes, *parts, reported);
  }
};

const HappenedEvent* of(const HappenedRecord& record, const std::string& object) {
  for (const HappenedEvent& event : record.events)
    if (event.object == object) return &event;
  return nullptr;
}

TEST_F(HappenedTest, ActionsThatNobodyReportsAreEvents) {
  const HappenedRecord record = happened({}, false);
  ASSERT_EQ(record.events.size(), 2u);
  EXPECT_EQ(record.events[0], (HappenedEvent{0.4, "slipped", "held", "release", false}));
  const HappenedEvent& push = record.events[1];
  EXPECT_EQ(push.event, "pushed");
  EXPECT_EQ(push.object, "pushed");
  EXPECT_NEAR(push.time, 0.56, 0.01);
}

TEST_F(HappenedTest, ReportedActionsAreNotWhatIsToBeExplained) {
  const HappenedRecord record = happened({}, true);
  ASSERT_EQ(record.events.size(), 2u);
  for (const HappenedEvent& event : record.events) {
    EXPECT_TRUE(event.reported);
    EXPECT_EQ(event.event, "");
  }
}

TEST_F(HappenedTest, SaysWhatMovedWhenAndWhereItEnds) {
  const HappenedRecord record = happened({}, true);
  ASSERT_EQ(record.objects.size(), 3u);
  const ObjectCourse& pushed = record.objects[0];
  ASSERT_TRUE(pushed.moved_from && pushed.moved_until && pushed.X_WO);
  EXPECT_NEAR(*pushed.moved_from, 0.57, 0.03);  // 2 mm after the touch, at 0.167 m/s
  EXPECT_GT(pushed.X_WO->translation.x(), -0.165);
  // It falls by 0.235 m until it lies on the table, which takes 0.22 s.
  const ObjectCourse& held = record.objects[1];
  ASSERT_TRUE(held.moved_from && held.moved_until && held.X_WO);
  EXPECT_NEAR(*held.moved_from, 0.4, 0.04);
  EXPECT_GT(*held.moved_until, 0.6);
  EXPECT_NEAR(held.X_WO->translation.z(), 0.025, 1e-3);
  EXPECT_FALSE(record.objects[2].moved_from);
  ASSERT_TRUE(record.objects[2].X_WO);
}

TEST_F(HappenedTest, ChangesAreEventsOfTheirKinds) {
  geometry::Twist blow;
  blow.linear = {0.0, 0.3, 0.0};
  const geometry::Pose there = geometry::Pose::from_translation({0.3, 0.3, 0.025});
  EXPECT_EQ(of(happened({{0.5, "apart", {}, {}}}, true), "apart")->event, "taken_away");
  EXPECT_EQ(of(happened({{0.5, "apart", there, {}}}, true), "apart")->event, "moved");
  EXPECT_EQ(of(happened({{0.5, "apart", {}, blow}}, true), "apart")->event, "bumped");
  EXPECT_EQ(of(happened({{0.0, "apart", {}, {}}, {0.5, "apart", there, {}}}, true), "apart")->event, "put_in");
  // Taken and put down elsewhere is one event.
  const HappenedRecord moved = happened({{0.3, "apart", {}, {}}, {0.5, "apart", there, {}}}, true);
  ASSERT_EQ(moved.events.size(), 3u);
  EXPECT_EQ(of(moved, "apart")->event, "moved");
  EXPECT_DOUBLE_EQ(of(moved, "apart")->time, 0.3);
  EXPECT_FALSE(happened({{0.5, "apart", {}, {}}}, true).objects[2].X_WO);
  // What is taken and not put down was taken away, also where something is said of it later.
  EXPECT_EQ(of(happened({{0.3, "apart", {}, {}}, {0.5, "apart", {}, blow}}, true), "apart")->event, "taken_away");
}

TEST_F(HappenedTest, WhatHappensAtOnceHasOneLabel) {
  const auto labels = [](const HappenedRecord& record, const std::string& object) {
    std::vector<std::string> all;
    for (const HappenedEvent& event : record.events)
      if (event.object == object) all.push_back(event.event);
    return all;
  };
  geometry::Twist blow;
  blow.linear = {0.0, 0.3, 0.0};
  const geometry::Pose there = geometry::Pose::from_translation({0.3, 0.3, 0.025});
  const UnannouncedChange put{0.5, "apart", there, {}}, hit{0.5, "apart", {}, blow};
  EXPECT_EQ(labels(happened({put, hit}, true), "apart"), std::vector<std::string>{"moved"});
  EXPECT_EQ(labels(happened({hit, put}, true), "apart"), std::vector<std::string>{"moved"});
  EXPECT_EQ(labels(happened({{0.5, "apart", {}, {}}, put}, true), "apart"), std::vector<std::string>{"moved"});
  // The hand that nobody announces opens by itself, and at that moment by a change, too.
  EXPECT_EQ(labels(happened({{0.4, "held", {}, blow}}, false), "held"), std::vector<std::string>{"slipped"});
}

TEST_F(HappenedTest, IsReadAsItWasWritten) {
  HappenedRecord record = happened({{0.5, "apart", {}, {}}}, false);
  record.first_ns = 1'000'000'000'000'000'000;
  record.stepper = "bullet";
  record.step = 0.001;
  record.resolution = kInterval;
  record.joints.push_back({"slide", 0.125});
  const auto read = happened_from_json(to_json(record).dump());
  ASSERT_TRUE(read.ok()) << read.status().message();
  EXPECT_EQ(*read, record);
  for (const char* text : {"", "[]", "{}", R"({"first_ns": 1, "events": [1], "objects": [], "joints": []})",
                           R"({"first_ns": 18446744073709551615, "events": [], "objects": [], "joints": []})",
                           R"({"first_ns": 9223372036854775807, "events": [], "objects": [], "joints": []})",
                           R"({"first_ns": -1, "events": [], "objects": [], "joints": []})",
                           R"({"first_ns": 1, "events": [], "objects": [{"name": "a"}], "joints": []})"})
    EXPECT_EQ(happened_from_json(text).status().code(), core::StatusCode::kDataLoss) << text;
}

}  // namespace
}  // namespace prescene::service::happened_test
