// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/recording/foreseen.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/interfaces/ros_messages/conversions.h"
#include "prescene/service/load_scene.h"
#include "prescene/service/tracking/topics.h"

namespace prescene::service {
namespace {

using testing::HasSubstr;

constexpr core::TimeNs kStart = 1'000'000'000'000'000'000;
constexpr const char* kScene = R"(name: box
models:
  box: {box: [0.1, 0.1, 0.1], mass: 0.4}
supports:
  floor: {ground: {size: 4}}
objects:
  box: {model: box, pose: {position: [0, 0, 1]}}
exclusive_outcomes:
  height:
    object: box
    outcomes:
      low: {below: 0.25}
      middle: {below: 0.6}
  place:
    object: box
    outcomes:
      on_floor: {resting_on: floor}
outcomes:
  lies: {object: box, resting_on: floor}
  flies: {object: box, not: {below: 0.9}, resting_on: floor}
  moved: {object: box, moved_more_than: 0.1}
)";

std::shared_ptr<const belief::Scene> scene() {
  auto read = load_scene_text(kScene, "box.yaml", {});
  EXPECT_TRUE(read.ok()) << read.status().message();
  return *std::move(read);
}

/// Falls by 0.1 m each tenth of a second from 1 m on and lies from 0.95 s on.
double height_at(double time) { return std::max(0.05, 1.0 - time); }

BeliefSummary summary_at(std::uint64_t step, double time, const geometry::Vector3d& position,
                         belief::TrackState state = belief::TrackState::kTracked) {
  BeliefSummary summary{step, kStart + static_cast<core::TimeNs>(std::llround(time * 1e9)), {}};
  ObjectSummary object;
  object.name = "box";
  object.state = state;
  object.X_WO.translation = position;
  summary.objects.push_back(object);
  return summary;
}

const CameOutcome& named(const OutcomeRecord& record, const std::string& name, const std::string& group) {
  const auto found = std::find_if(record.outcomes.begin(), record.outcomes.end(), [&](const CameOutcome& outcome) {
    return outcome.group == group && (name.empty() || outcome.name == name);
  });
  EXPECT_NE(found, record.outcomes.end()) << name << " " << group;
  return *found;
}

TEST(OutcomesOf, ATrajectoryTellsWhatCameAndFromWhenOn) {
  belief::Trajectory trajectory;
  for (int i = 0; i <= 20; ++i) {
    belief::WorldState state;
    state.time = 0.1 * i;
    belief::ObjectState object;
    object.X_WO.translation = {0.0, 0.0, height_at(state.time)};
    object.V_WO.linear = {0.0, 0.0, i < 10 ? -1.0 : 0.0};
    state.objects.push_back(object);
    trajectory.states.push_back(state);
  }
  trajectory.contacts.push_back({0, 1, 0.95, 2.0, 0.1, 1.0});
  const OutcomeRecord record = outcomes_of(*scene(), trajectory, kStart);
  EXPECT_EQ(record.end_ns, kStart + 2'000'000'000);
  EXPECT_EQ(named(record, "", "height").name, "low");
  EXPECT_EQ(named(record, "", "height").since_ns, kStart + 800'000'000) << "0.2 m, and not 0.3 m, is below 0.25 m";
  EXPECT_EQ(named(record, "", "place").name, "on_floor");
  EXPECT_EQ(named(record, "", "place").since_ns, kStart + 1'000'000'000);
  EXPECT_EQ(named(record, "lies", "").came, true);
  EXPECT_EQ(named(record, "flies", "").came, false);
  const auto again = outcome_record_from_json(to_json(record).dump());
  ASSERT_TRUE(again.ok()) << again.status().message();
  EXPECT_EQ(to_json(*again), to_json(record));
}

TEST(OutcomesOf, TrackedPosesTellWhatNeedsNoContacts) {
  std::map<core::TimeNs, BeliefSummary> summaries;
  const auto add = [&](const BeliefSummary& summary) { summaries[summary.stamp_ns] = summary; };
  for (int i = 0; i <= 20; ++i) add(summary_at(static_cast<std::uint64_t>(i), 0.1 * i, {0, 0, height_at(0.1 * i)}));
  const OutcomeRecord record = outcomes_of(*scene(), summaries);
  EXPECT_EQ(named(record, "low", "height").came, true);
  EXPECT_EQ(named(record, "", "place").came, std::nullopt);
  EXPECT_EQ(named(record, "lies", "").came, std::nullopt);
  EXPECT_EQ(named(record, "flies", "").came, false) << "whatever it touches, it is not high up";
  EXPECT_EQ(named(record, "moved", "").came, true);
  // What is lost in the end may be anywhere.
  add(summary_at(21, 2.1, {0, 0, 0}, belief::TrackState::kLost));
  for (const CameOutcome& outcome : outcomes_of(*scene(), summaries).outcomes) EXPECT_EQ(outcome.came, std::nullopt);
}

class ForeseenAndCameTest : public ::testing::Test {
 protected:
  // The box is carried along x at 0.1 m/s until 2 s, waits, and is let go at 2.5 s.
  void SetUp() override {
    foreseen_.add(entry(
        kControlTopic, R"({"stamp_ns": 1000000002500000000, "actions": [{"time": 0, "release": {"object": "box"}}]})"));
    for (int i = 0; i <= 40; ++i) {
      const double time = 0.1 * i;
      foreseen_.add(
          summary_at(static_cast<std::uint64_t>(i), time, {0.1 * std::min(time, 2.0), 0.0, time < 2.6 ? 1.0 : 0.05}));
    }
  }
  static RecordedEntry entry(const std::string& topic, const std::string& text) {
    RecordedEntry entry;
    entry.message = {topic, "std_msgs/msg/String", interfaces::encode_cdr(interfaces::RosString{text}), kStart, kStart};
    return entry;
  }
  Comparison asked(double at, const std::string& question) {
    const nlohmann::ordered_json answer = {
        {"step", std::lround(10.0 * at)},
        {"predict",
         {{"outcomes",
           {{{"name", "low"}, {"group", "height"}, {"probability", 0.92}, {"interval", {0.9, 0.94}}},
            {{"name", "other"}, {"group", "height"}, {"probability", 0.08}, {"interval", {0.06, 0.1}}},
            {{"name", "lies"}, {"group", ""}, {"probability", 0.001}, {"interval", {0.0, 0.01}}}}}}}};
    foreseen_.add(at, question, answer.dump());
    const std::vector<Comparison> comparisons = foreseen_.comparisons();
    EXPECT_FALSE(comparisons.empty());
    return comparisons.empty() ? Comparison{} : comparisons.back();
  }

  ForeseenAndCame foreseen_{scene()};
  const std::string release_ = R"({"predict": {"actions": [{"time": 0, "release": {"object": "box"}}]}})";
};

TEST_F(ForeseenAndCameTest, AQuestionAboutAnotherTimeAndPlaceIsNotComparedWithWhatCame) {
  const Comparison early = asked(1.0, release_);
  EXPECT_FALSE(early.comparable);
  EXPECT_EQ(early.question, "What if box is let go at 1.00 s?");
  EXPECT_THAT(early.note, HasSubstr("let box go at 2.50 s, 1.50 s later, when it was 10 cm further"));
  EXPECT_THAT(early.note, HasSubstr("does not test it"));
}

TEST_F(ForeseenAndCameTest, AQuestionJustBeforeTheReleaseIsComparedWithWhatCame) {
  const Comparison late = asked(2.4, release_);
  EXPECT_TRUE(late.comparable);
  EXPECT_THAT(late.note, HasSubstr("let box go at 2.50 s, 0.10 s later and from the same place"));
  ASSERT_EQ(late.rows.size(), 3U);
  EXPECT_EQ(foreseen_text(late.rows[0]), "92 % (90 to 94 %)");
  EXPECT_EQ(came_text(late.rows[0]), "yes, from 2.60 s on");
  EXPECT_EQ(came_text(late.rows[1]), "no");
  EXPECT_EQ(came_text(late.rows[2]), "not known");
  EXPECT_TRUE(is_worth_a_row(late.rows[1]));
  EXPECT_FALSE(is_worth_a_row(late.rows[2]));
  EXPECT_FALSE(foreseen_.knows_truth());
}

TEST_F(ForeseenAndCameTest, WhatNeverHappenedAndWhatCannotBeJudgedIsSaid) {
  EXPECT_THAT(asked(3.0, release_).note, HasSubstr("did not let box go after that"));
  const Comparison nothing = asked(1.0, R"({"predict": {}})");
  EXPECT_EQ(nothing.question, "What happens if nothing is done?");
  EXPECT_FALSE(nothing.comparable);
  foreseen_.add(1.0, release_, "{\"predict\": 7}");
  foreseen_.add(1.0, "[", "[");
  EXPECT_EQ(foreseen_.comparisons().size(), 2U);
}

TEST_F(ForeseenAndCameTest, TheSimulatedTruthGoesBeforeWhatWasTracked) {
  RecordedEntry truth = entry(kOutcomeTopic, "");
  const OutcomeRecord record{kStart + 4'000'000'000, {{"middle", "height", true, kStart + 3'000'000'000}}};
  const std::string text = to_json(record).dump();
  truth.message.cdr.assign(text.begin(), text.end());
  truth.is_json = true;
  foreseen_.add(truth);
  const Comparison late = asked(2.4, release_);
  EXPECT_TRUE(foreseen_.knows_truth());
  EXPECT_EQ(came_text(late.rows[0]), "no");
}

/// A live recording of a robot on simulated time: frames are stamped by it, entries by the machine's steady clock, and
/// controls are sent at wall times.
class OnSimulatedTime : public ::testing::Test {
 protected:
  static constexpr core::TimeNs kMs = 1'000'000;
  static constexpr core::TimeNs kBooted = 1000 * 1000 * kMs;  // steady time of the first entry

  void SetUp() override {
    for (int i = 0; i <= 40; ++i) {
      const core::TimeNs received_ns = kBooted + 100 * kMs * i;
      interfaces::RosImage image;
      image.header.stamp = interfaces::to_ros_time(100 * kMs * i);
      image.header.frame_id = "camera";
      add(InputTopics().depth, "sensor_msgs/msg/Image", interfaces::encode_cdr(image), received_ns);
      if (i == 25)
        add(kControlTopic, "std_msgs/msg/String",
            interfaces::encode_cdr(
                interfaces::RosString{R"({"actions": [{"time": 0, "release": {"object": "box"}}]})"}),
            received_ns + kMs);
      BeliefSummary summary = summary_at(static_cast<std::uint64_t>(i), 0.1 * i, {0.0, 0.0, i < 26 ? 1.0 : 0.05});
      summary.stamp_ns -= kStart;
      foreseen_.add(summary);
    }
  }
  void add(const std::string& topic, const std::string& type, std::vector<std::uint8_t> cdr, core::TimeNs received_ns) {
    RecordedEntry entry;
    entry.message = {topic, type, std::move(cdr), kStart, received_ns};
    foreseen_.add(entry);
  }

  ForeseenAndCame foreseen_{scene()};
};

TEST_F(OnSimulatedTime, AReleaseIsFoundByTheClockOfTheFrames) {
  const nlohmann::ordered_json answer = {
      {"step", 24},
      {"predict",
       {{"outcomes", {{{"name", "low"}, {"group", "height"}, {"probability", 0.9}, {"interval", {0.8, 1.0}}}}}}}};
  foreseen_.add(2.4, R"({"predict": {"actions": [{"time": 0, "release": {"object": "box"}}]}})", answer.dump());
  const std::vector<Comparison> comparisons = foreseen_.comparisons();
  ASSERT_EQ(comparisons.size(), 1U);
  EXPECT_THAT(comparisons[0].question, HasSubstr("let go at 2.40 s"));
  EXPECT_THAT(comparisons[0].note, HasSubstr("let box go at 2.50 s, 0.10 s later and from the same place"));
  EXPECT_TRUE(comparisons[0].comparable);
  EXPECT_EQ(came_text(comparisons[0].rows[0]), "yes, from 2.60 s on");
}

TEST(ForeseenAndCame, CountsDamagedRecordsOfWhatCame) {
  ForeseenAndCame foreseen(scene());
  RecordedEntry entry;
  entry.message = {kOutcomeTopic, "", {'{', '}'}, kStart, kStart};
  entry.is_json = true;
  foreseen.add(entry);
  foreseen.add(entry);
  EXPECT_EQ(foreseen.damaged_records(), 2U);
  EXPECT_THAT(foreseen.first_damage().message(), HasSubstr("damaged"));
  EXPECT_FALSE(foreseen.knows_truth());
}

}  // namespace
}  // namespace prescene::service
