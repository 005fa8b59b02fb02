// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/live/typed_messages.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

#include "prescene/belief/json.h"
#include "prescene/core/random.h"
#include "prescene/interfaces/mcap/mcap_reader.h"
#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/interfaces/ros_messages/schemas.h"
#include "prescene/service/recording/recording.h"
#include "prescene/service/tracking/topics.h"
#include "tests/support/paths.h"

namespace prescene::service::typed_messages_test {
namespace {

using interfaces::RosAnswer;
using interfaces::RosAnswerState;
using interfaces::RosCancel;
using interfaces::RosObjectMotion;
using interfaces::RosObjectState;
using interfaces::RosQuery;
using nlohmann::ordered_json;
using testing::ElementsAre;
using testing::HasSubstr;

template <class Enum>
std::uint8_t number(Enum value) {
  return static_cast<std::uint8_t>(value);
}

BeliefSummary mug_and_lid() {
  BeliefSummary summary;
  summary.step = 41;
  summary.stamp_ns = 7'000'000'008;
  ObjectSummary mug;
  mug.name = "mug";
  mug.model = "clay";
  mug.state = belief::TrackState::kUnseen;
  mug.motion = belief::MotionMode::kHeld;
  mug.held_by = "gripper";
  mug.confidence = 0.75;
  mug.existence = 0.5;
  mug.visible_share = 0.25;
  mug.X_WO.translation = {1.0, 2.0, 3.0};
  mug.covariance = 0.01 * geometry::Matrix6d::Identity();
  mug.V_WO.linear = {0.1, 0.2, 0.3};
  mug.V_WO.angular = {0.4, 0.5, 0.6};
  mug.parameters = {{"friction", 0.5, 0.1, 0.3, 0.7}};
  mug.lessons = 3;
  mug.learned_ns = 5'000'000'006;
  mug.alternatives = {{geometry::Pose::identity(), 0.125}};
  summary.objects.push_back(mug);
  summary.joints.push_back(
      {"lid", belief::JointType::kSlider, 0.5, 0.1, -0.2, -1.0, std::numeric_limits<double>::infinity(), 0.75});
  return summary;
}

TEST(TypedMessages, ABeliefHasWhatTheSummaryHas) {
  const interfaces::RosBelief belief = belief_message(mug_and_lid(), "map");
  EXPECT_EQ(belief.header, (interfaces::RosHeader{{7, 8}, "map"}));
  EXPECT_EQ(belief.step, 41U);
  ASSERT_EQ(belief.objects.size(), 1U);
  const interfaces::RosObjectBelief& mug = belief.objects[0];
  EXPECT_EQ(mug.name, "mug");
  EXPECT_EQ(mug.model, "clay");
  EXPECT_EQ(mug.state, number(RosObjectState::kUnseen));
  EXPECT_EQ(mug.motion, number(RosObjectMotion::kHeld));
  EXPECT_EQ(mug.held_by, "gripper");
  EXPECT_EQ(mug.confidence, 0.75);
  EXPECT_EQ(mug.existence, 0.5);
  EXPECT_EQ(mug.visible_share, 0.25);
  EXPECT_EQ(mug.pose.pose.position, (interfaces::RosPoint{1.0, 2.0, 3.0}));
  EXPECT_DOUBLE_EQ(mug.pose.covariance[0], 0.01);
  EXPECT_DOUBLE_EQ(mug.pose.covariance[35], 0.01);
  EXPECT_EQ(mug.twist, (interfaces::RosTwist{{0.1, 0.2, 0.3}, {0.4, 0.5, 0.6}}));
  EXPECT_THAT(mug.parameters, ElementsAre(interfaces::RosParameterEstimate{"friction", 0.5, 0.1, 0.3, 0.7}));
  EXPECT_EQ(mug.lessons, 3U);
  EXPECT_EQ(mug.learned, (interfaces::RosTime{5, 6}));
  ASSERT_EQ(mug.alternatives.size(), 1U);
  EXPECT_EQ(mug.alternatives[0].probability, 0.125);
  ASSERT_EQ(belief.joints.size(), 1U);
  EXPECT_EQ(belief.joints[0], (interfaces::RosJointBelief{"lid", number(interfaces::RosJointType::kSlider), 0.5, 0.1,
                                                          -0.2, -1.0, std::numeric_limits<double>::infinity(), 0.75}));
}

TEST(TypedMessages, ATimeThatRosCannotSayIsTheNearestThatItCan) {
  BeliefSummary summary = mug_and_lid();
  summary.objects[0].learned_ns = -5;
  EXPECT_EQ(belief_message(summary, "map").objects[0].learned, (interfaces::RosTime{0, 0}));
  summary.objects[0].learned_ns = std::numeric_limits<core::TimeNs>::max();
  EXPECT_EQ(belief_message(summary, "map").objects[0].learned, (interfaces::RosTime{2147483647, 999'999'999}));
}

TEST(TypedMessages, AnEventHasItsWordsAndEmptyOnesForNull) {
  BeliefEvent event{7'000'000'008, 41, "held"};
  event.object = "mug";
  event.to = "gripper";
  EXPECT_EQ(event_message(event, "map"),
            (interfaces::RosEvent{{{7, 8}, "map"}, 41, "held", "mug", "", "", "", "gripper", ""}));
}

TEST(TypedMessages, AQuestionIsTheJsonOfItsFieldsAndArguments) {
  const auto json = [](const RosQuery& query) {
    const auto text = question_json(query);
    EXPECT_TRUE(text.ok()) << text.status().message();
    return text ? ordered_json::parse(*text) : ordered_json();
  };
  EXPECT_EQ(json({"", "where", "", 0.0, 0.0, false, {}, ""}), ordered_json::parse(R"({"where": {}})"));
  EXPECT_EQ(json({"1", "where", "mug", 0.0, 0.0, false, {}, " {} "}),
            ordered_json::parse(R"({"id": "1", "where": {"object": "mug"}})"));
  EXPECT_EQ(json({"4", "predict", "", 2.5, 0.5, true, {"inputs"}, R"({"actions": [], "effort": {"tolerance": 0.1}})"}),
            ordered_json::parse(R"({"id": "4", "stream": true, "predict": {"actions": [],
              "effort": {"tolerance": 0.1, "max_seconds": 0.5}, "duration": 2.5, "detail": ["inputs"]}})"));
  // What is asked so is a question to who reads the JSON.
  const auto stability = belief::query_from_json(*question_json({"6", "stability", "mug", 3.0, 1.0, false, {}, ""}));
  ASSERT_TRUE(stability.ok()) << stability.status().message();
  const auto& what = std::get<belief::StabilityQuery>(stability->what);
  EXPECT_EQ(what.object, "mug");
  EXPECT_EQ(what.effort.max_seconds, 1.0);
}

TEST(TypedMessages, WhatIsNoQuestionIsRefusedWithFieldAndRemedy) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<std::pair<RosQuery, std::string>> bad = {
      {{"1", "", "", 0.0, 0.0, false, {}, ""}, "kind: '' is not a kind"},
      {{"1", "cancel", "", 0.0, 0.0, false, {}, ""}, "kind: 'cancel' is not a kind"},
      {{"\xff", "where", "", 0.0, 0.0, false, {}, ""}, "id: byte 0 is not UTF-8"},
      {{"1", "where", "m\xc3", 0.0, 0.0, false, {}, ""}, "object: byte 1 is not UTF-8"},
      {{"1", "predict", "", 0.0, 0.0, false, {"inputs", "\x80"}, ""}, "detail: byte 0 is not UTF-8"},
      {{"1", "predict", "", nan, 0.0, false, {}, ""}, "duration: the number is not finite"},
      {{"1", "predict", "", 0.0, -std::numeric_limits<double>::infinity(), false, {}, ""},
       "max_seconds: the number is not finite"},
      {{"1", "predict", "", 0.0, 0.0, false, {}, "[1]"}, "arguments: this is not a JSON object"},
      {{"1", "predict", "", 0.0, 0.0, false, {}, "{"}, "arguments"},
      {{"1", "where", "mug", 0.0, 0.0, false, {}, R"({"object": "cup"})"}, "arguments: 'object' is given by a field"},
      {{"1", "predict", "", 0.0, 1.0, false, {}, R"({"effort": {"max_seconds": 2}})"}, "arguments: 'max_seconds'"},
      {{"1", "predict", "", 0.0, 1.0, false, {}, R"({"effort": 2})"}, "arguments: effort"},
      {{"1", "predict", "", 0.0, 0.0, false, {}, std::string(kLongestArguments + 1, ' ')}, "ask as JSON"},
      {{"1", "predict", "", 0.0, 0.0, false, std::vector<std::string>(65), ""}, "detail: 65 texts are more than 64"},
      {{"1", "where", std::string(4097, 'm'), 0.0, 0.0, false, {}, ""}, "object: 4097 bytes are more than 4096"}};
  for (const auto& [query, reason] : bad) {
    const auto json = question_json(query);
    ASSERT_FALSE(json.ok()) << *json;
    EXPECT_THAT(json.status().message(), HasSubstr(reason));
  }
  EXPECT_EQ(*cancel_json({"7", ""}), R"({"cancel":"7"})");
  EXPECT_EQ(*cancel_json({"7", "c"}), R"({"cancel":"7","id":"c"})");
  EXPECT_THAT(cancel_json({"", "c"}).status().message(), HasSubstr("question: give the id"));
  EXPECT_THAT(cancel_json({"\xff", "c"}).status().message(), HasSubstr("question: byte 0"));
}

TEST(TypedMessages, AnswersHaveTheirEstimates) {
  const RosAnswer predict = answer_message(
      R"({"id": "4", "step": 412, "predict": {"outcomes": [
        {"name": "in_bin", "group": "ends", "probability": 0.5, "interval": [0.25, 0.75]},
        {"name": "touches", "probability": 1.0, "interval": [0.875, 1.0]}],
        "instances": 384, "converged": true, "remarks": ["a remark"]}})");
  EXPECT_EQ(predict.id, "4");
  EXPECT_EQ(predict.step, 412U);
  EXPECT_EQ(predict.kind, "predict");
  EXPECT_EQ(predict.state, number(RosAnswerState::kAnswered));
  EXPECT_THAT(predict.estimates, ElementsAre(interfaces::RosEstimate{"in_bin", "ends", "", "", 0.5, 0.25, 0.75},
                                             interfaces::RosEstimate{"touches", "", "", "", 1.0, 0.875, 1.0}));
  EXPECT_EQ(predict.instances, 384U);
  EXPECT_TRUE(predict.converged);
  EXPECT_THAT(predict.remarks, ElementsAre("a remark"));

  const RosAnswer so_far = answer_message(
      R"({"id": "6", "step": 0, "final": false, "stability": {"object": "carton",
        "stable": {"name": "stable", "probability": 0.0, "interval": [0.0, 0.125]}, "instances": 32}})");
  EXPECT_EQ(so_far.state, number(RosAnswerState::kSoFar));
  EXPECT_THAT(so_far.estimates, ElementsAre(interfaces::RosEstimate{"stable", "", "carton", "", 0.0, 0.0, 0.125}));

  const RosAnswer relations = answer_message(
      R"({"id": "2", "step": 1, "relations": {"relations": [
        {"relation": "on", "subject": "mug", "other": "table", "probability": 0.5, "interval": [0.25, 0.75]}]}})");
  EXPECT_THAT(relations.estimates, ElementsAre(interfaces::RosEstimate{"on", "", "mug", "table", 0.5, 0.25, 0.75}));

  const RosAnswer refused = answer_message(R"({"id": "4", "step": 3, "error": "no such object", "code": "not_found"})");
  EXPECT_EQ(refused.state, number(RosAnswerState::kRefused));
  EXPECT_EQ(refused.error, "no such object");
  EXPECT_EQ(refused.code, "not_found");

  EXPECT_EQ(answer_message(R"({"id": "c", "cancelled": "1"})").state, number(RosAnswerState::kCancelled));
}

// Query.msg lists the kinds of questions in the line above `kind`.
TEST(TypedMessages, AnAnswerNamesEachKindOfQuestionThatThereIs) {
  std::ifstream file(tests::source_dir() / "packaging/prescene_msgs/msg/Query.msg");
  std::string kinds;
  for (std::string line; std::getline(file, line) && line != "string kind";) kinds = line;
  std::size_t count = 0;
  for (std::size_t from = kinds.find('"'); from != std::string::npos; from = kinds.find('"', from + 1), ++count) {
    const std::size_t to = kinds.find('"', from + 1);
    const std::string kind = kinds.substr(from + 1, to - from - 1);
    const RosAnswer answer = answer_message(ordered_json{{"step", 1}, {kind, ordered_json::object()}}.dump());
    EXPECT_EQ(answer.kind, kind);
    EXPECT_EQ(answer.state, number(RosAnswerState::kAnswered)) << kind;
    from = to;
  }
  EXPECT_EQ(count, 10U);
}

TEST(TypedMessages, AnAnswerToWhereHasTheObjectsOfTheBelief) {
  belief::WhereAnswer::Item item;
  item.object = "mug";
  item.model = "clay";
  item.state = belief::TrackState::kDoubtful;
  item.existence = 0.5;
  item.estimate.mean.translation = {1.0, 2.0, 3.0};
  item.estimate.covariance = 0.01 * geometry::Matrix6d::Identity();
  item.estimate.confidence = 0.75;
  item.estimate.motion = belief::MotionMode::kResting;
  item.parameters = {{"friction", 0.5, 0.1, 0.3, 0.7}};
  item.alternatives = {{geometry::Pose::identity(), 0.125}};
  belief::Answer answer;
  answer.id = "1";
  answer.step = 9;
  answer.what = belief::WhereAnswer{{item}, {}};
  const RosAnswer message = answer_message(belief::json_text(belief::to_json(answer)));
  EXPECT_EQ(message.kind, "where");
  ASSERT_EQ(message.objects.size(), 1U);
  const interfaces::RosObjectBelief& mug = message.objects[0];
  EXPECT_EQ(mug.name, "mug");
  EXPECT_EQ(mug.model, "clay");
  EXPECT_EQ(mug.state, number(RosObjectState::kDoubtful));
  EXPECT_EQ(mug.motion, number(RosObjectMotion::kResting));
  EXPECT_EQ(mug.confidence, 0.75);
  EXPECT_EQ(mug.pose.pose.position, (interfaces::RosPoint{1.0, 2.0, 3.0}));
  EXPECT_DOUBLE_EQ(mug.pose.covariance[35], 0.01);
  ASSERT_EQ(mug.parameters.size(), 1U);
  ASSERT_EQ(mug.alternatives.size(), 1U);
}

TEST(TypedMessages, AnswersOfAnotherFormAreCarriedAsJson) {
  for (const char* json : {"", "no JSON", "[]", "7", R"({"id": "1", "levitate": {}})", R"({"id": 1, "step": -3})"}) {
    const RosAnswer answer = answer_message(json);
    EXPECT_EQ(answer.json, json);
    EXPECT_EQ(answer.state, number(RosAnswerState::kUnknown)) << json;
  }
  for (const char* json : {R"({"predict": 7})", R"({"predict": {"outcomes": [7, {"name": 3, "interval": [1]}]}})",
                           R"({"where": {"items": [7, {"object": "mug", "estimate": []}]}})",
                           R"({"stability": {"stable": "yes", "instances": -1, "converged": 3, "remarks": {}}})"}) {
    EXPECT_EQ(answer_message(json).state, number(RosAnswerState::kAnswered)) << json;
    EXPECT_TRUE(answer_message(json).objects.empty()) << json;
  }
}

TEST(TypedMessages, DamagedAnswersNeverFail) {
  const std::string whole =
      R"({"id": "4", "step": 412, "final": true, "where": {"items": [{"object": "mug", "model": "clay", "state": "tracked",
        "estimate": {"mean": {"position": [1, 2, 3], "rotation": {"quaternion_wxyz": [1, 0, 0, 0]}}, "covariance": [[1]],
        "twist": {"linear": [1, 2, 3], "angular": [1, 2, 3]}, "motion": "held"}, "parameters": [], "alternatives": []}]}})";
  ASSERT_EQ(answer_message(whole).objects.size(), 1U);
  core::RandomStream stream(7, core::Purpose::kTest);
  for (int i = 0; i < 2000; ++i) {
    std::string damaged = whole;
    for (int k = 0; k < 3; ++k)
      damaged[stream.uniform_below(damaged.size())] = R"({}[]",:170a)"[stream.uniform_below(12)];
    EXPECT_EQ(answer_message(damaged).json, damaged);
    static_cast<void>(progress_message(damaged));
  }
}

TEST(TypedMessages, ProgressSaysWhetherThereIsAnEstimate) {
  EXPECT_EQ(progress_message(R"({"id": "1", "fraction": 0.5, "text": "simulating", "seconds_left": 0.25})"),
            (interfaces::RosProgress{"1", 0.5, "simulating", 0.25}));
  EXPECT_EQ(progress_message(R"({"id": "1", "fraction": 0.5, "text": "simulating", "seconds_left": null})"),
            (interfaces::RosProgress{"1", 0.5, "simulating", -1.0}));
}

TEST(TypedMessages, AreRecordedWithTheirTextsAndReadAgain) {
  const tests::ScratchDir folder;
  const std::filesystem::path path = folder.path() / "run.mcap";
  const interfaces::RosBelief belief = belief_message(mug_and_lid(), "map");
  {
    auto writer = RecordingWriter::create(path, {});
    ASSERT_TRUE(writer.ok()) << writer.status().message();
    ASSERT_TRUE((*writer)
                    ->write_output(kTypedBeliefTopic, "prescene_msgs/msg/Belief", interfaces::encode_cdr(belief),
                                   7'000'000'008, 9'000'000'000)
                    .ok());
    ASSERT_TRUE((*writer)->close().ok());
  }
  auto reader = interfaces::McapReader::open(path);
  ASSERT_TRUE(reader.ok()) << reader.status().message();
  std::optional<interfaces::RosBelief> read;
  for (;;) {
    const auto message = (*reader)->next();
    ASSERT_TRUE(message.ok()) << message.status().message();
    if (!*message) break;
    const interfaces::McapChannel& channel = (*reader)->channels()[static_cast<std::size_t>((*message)->channel)];
    if (channel.topic != kTypedBeliefTopic) continue;
    EXPECT_EQ(channel.schema.name, "prescene_msgs/msg/Belief");
    EXPECT_EQ(channel.schema.encoding, "ros2msg");
    EXPECT_THAT(channel.schema.data, HasSubstr("MSG: prescene_msgs/ObjectBelief\nstring name\n"));
    EXPECT_THAT(channel.schema.data, HasSubstr("MSG: geometry_msgs/PoseWithCovariance\n"));
    const auto decoded = interfaces::decode_cdr<interfaces::RosBelief>((*message)->data);
    ASSERT_TRUE(decoded.ok()) << decoded.status().message();
    read = *decoded;
  }
  ASSERT_TRUE(read);
  EXPECT_EQ(*read, belief);
}

}  // namespace
}  // namespace prescene::service::typed_messages_test
