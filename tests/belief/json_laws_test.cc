// SPDX-License-Identifier: Apache-2.0
#include "prescene/belief/json.h"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "tests/belief/random_values.h"
#include "tests/support/laws.h"

namespace prescene::belief {
namespace {

using core::Purpose;
using core::RandomStream;
using Json = nlohmann::ordered_json;
using testing::HasSubstr;

TEST(JsonLaws, QueriesReadBackAsTheyWereWritten) {
  EXPECT_TRUE(tests::check_law([](std::uint64_t seed) {
    RandomStream stream(seed, Purpose::kTest);
    const Query query = tests::random_query(stream);
    const auto read = query_from_json(to_json(query).dump());
    RC_ASSERT(read.status() == core::ok_status());
    RC_ASSERT(*read == query);
  }));
}

TEST(JsonLaws, ActionsAndOutcomesReadBackAsTheyWereWritten) {
  EXPECT_TRUE(tests::check_law([](std::uint64_t seed) {
    RandomStream stream(seed, Purpose::kTest);
    const Action action = tests::random_action(stream);
    const auto read_action = action_from_json(Json::parse(to_json(action).dump()));
    RC_ASSERT(read_action.status() == core::ok_status());
    RC_ASSERT(*read_action == action);
    const Outcome outcome = tests::random_outcome(stream, "o");
    const auto read_outcome = outcome_from_json(Json::parse(to_json(outcome).dump()));
    RC_ASSERT(read_outcome.status() == core::ok_status());
    RC_ASSERT(*read_outcome == outcome);
  }));
}

TEST(JsonLaws, BeliefsReadBackWithTheSameBits) {
  const auto scene = std::make_shared<const Scene>(tests::small_scene());
  EXPECT_TRUE(tests::check_law([&](std::uint64_t seed) {
    RandomStream stream(seed, Purpose::kTest);
    Belief belief = tests::random_belief(stream, scene);
    if (!belief.objects.empty())
      belief.objects[0].particles.back().log_weight = -std::numeric_limits<double>::infinity();
    const auto read = belief_from_json(Json::parse(to_json(belief).dump()), scene);
    RC_ASSERT(read.status() == core::ok_status());
    RC_ASSERT(*read == belief);
    RC_ASSERT(content_hash(*read) == content_hash(belief));
  }));
}

// Every place of a document where a key stands, as a pointer to the object and the key.
void for_each_key(Json& value, const std::function<void(Json&, const std::string&)>& visit) {
  if (value.is_object()) {
    std::vector<std::string> keys;
    for (const auto& [key, item] : value.items()) keys.push_back(key);
    for (const std::string& key : keys) {
      visit(value, key);
      for_each_key(value[key], visit);
    }
  } else if (value.is_array()) {
    for (Json& item : value) for_each_key(item, visit);
  }
}

TEST(JsonLaws, AMistypedKeyIsAnErrorThatNamesIt) {
  EXPECT_TRUE(tests::check_law([](std::uint64_t seed) {
    RandomStream stream(seed, Purpose::kTest);
    Json document = to_json(tests::random_query(stream));
    for_each_key(document, [&](Json& object, const std::string& key) {
      const Json original = object;
      Json changed = Json::object();
      for (const auto& [name, item] : original.items()) changed[name == key ? name + "x" : name] = item;
      object = changed;
      const auto read = query_from_json(document.dump());
      RC_ASSERT(!read.ok());
      RC_ASSERT(read.status().message().find(key) != std::string::npos);
      object = original;
    });
  }));
}

TEST(JsonLaws, AValueOfAnotherTypeIsAnErrorOrStillRead) {
  EXPECT_TRUE(tests::check_law([](std::uint64_t seed) {
    RandomStream stream(seed, Purpose::kTest);
    Json document = to_json(tests::random_query(stream));
    for_each_key(document, [&](Json& object, const std::string& key) {
      for (const Json& other :
           {Json(nullptr), Json("text"), Json::array({1, "x"}), Json::object(), Json(true), Json(-1e300)}) {
        const Json original = object[key];
        object[key] = other;
        const auto read = query_from_json(document.dump());
        if (!read.ok()) RC_ASSERT(!read.status().message().empty());
        object[key] = original;
      }
    });
  }));
}

TEST(QueryFromJson, NamesThePathOfWhatIsWrong) {
  const auto message = [](const char* text) { return query_from_json(text).status().message(); };
  EXPECT_THAT(message(R"({"predict": {"actions": [{"time": 0, "push": {"from": [0, 0], "to": [1, 0, 0]}}]}})"),
              HasSubstr("predict.actions[0].push.from: a list of 3 is needed"));
  EXPECT_THAT(message(R"({"stability": {"objekt": "cup"}})"), HasSubstr("object"));
  EXPECT_THAT(message(R"({"where": {}, "view": {}})"), HasSubstr("view: 'where' is there already"));
  EXPECT_THAT(message(R"({"where": )"), HasSubstr("this is not JSON"));
  EXPECT_THAT(message(""), HasSubstr("this is not JSON"));
  EXPECT_THAT(message("[]"), HasSubstr("an object {...} is needed"));
  EXPECT_THAT(message(R"({"predict": {"effort": {"tolerance": 1e999}}})"), HasSubstr("JSON"));
  EXPECT_THAT(message(R"({"stability": {"object": "cup", "max_move": -1}})"), HasSubstr("stability.max_move"));
  EXPECT_EQ(query_from_json(std::string(2 << 20, ' ')).status().code(), core::StatusCode::kResourceExhausted);
  EXPECT_EQ(query_from_json(std::string(100000, '[')).status().code(), core::StatusCode::kInvalidInput);
  const std::string deep = R"({"where": )" + std::string(100000, '[') + std::string(100000, ']') + "}";
  EXPECT_THAT(message(deep.c_str()), HasSubstr("nested deeper than 64"));
  EXPECT_THAT(
      message(
          R"({"where": {"object": "[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[["}, "a": 1})"),
      HasSubstr("unknown key"));
  EXPECT_THAT(
      message(R"({"stability": {"object": "cup", "max_mvoe": 1}})"),
      HasSubstr("stability.max_mvoe: unknown key; did you mean 'max_move'? The keys here are object, max_move"));
  EXPECT_THAT(message(R"({"stability": {"object": "cup", "weather": 1}})"),
              HasSubstr("stability.weather: unknown key; the keys here are object, max_move"));
}

TEST(QueryFromJson, RefusesPositionsOfNoDistribution) {
  for (const char* x :
       {R"({"samples": []})", R"({"samples": {}})", R"({"normal": [0, 1], "min": 2, "max": 1})",
        R"({"normal": [0, 0], "min": 2, "max": 1})", R"({"normal": [0, -1]})", R"({"uniform": [1, 0]})", R"({})"}) {
    const std::string place = R"({"time": 0, "place": {"object": "cup", "pose": {"position": [)" + std::string(x) +
                              R"(, 0, 0], "normal": {"position": 0.1}}}})";
    const auto query = query_from_json(R"({"predict": {"actions": [)" + place + "]}}");
    EXPECT_THAT(query.status().message(), HasSubstr("pose.position[0]")) << x;
    EXPECT_FALSE(action_from_json(Json::parse(place)).ok()) << x;
  }
  EXPECT_THAT(query_from_json(R"({"predict": {"actions": [{"place": {"object": "cup", "pose": {"samples": []}}}]}})")
                  .status()
                  .message(),
              HasSubstr("pose.samples"));
}

TEST(QueryFromJson, FillsInWhatIsNotSaid) {
  const auto query = query_from_json(R"({"stability": {"object": "cup"}})");
  ASSERT_TRUE(query.ok());
  StabilityQuery expected;
  expected.object = "cup";
  EXPECT_EQ(std::get<StabilityQuery>(query->what), expected);
  EXPECT_EQ(query->id, "");
  const auto faces =
      query_from_json(R"({"predict": {"exclusive_outcomes": [{"name": "up", "object": "cup", "face_up": true}]}})");
  ASSERT_TRUE(faces.ok());
  EXPECT_EQ(std::get<PredictQuery>(faces->what).exclusive_outcomes[0], which_face_up("up", "cup"));
}

TEST(AnswerToJson, HasTheKeysThatTheCommandLinePromises) {
  PredictAnswer predict;
  predict.outcomes = {{"in", "where", 0.25, 0.2, 0.3}, {"touched", "", 1.0, 0.99, 1.0}};
  predict.instances = 512;
  predict.simulated_seconds = 3.5;
  predict.wall_seconds = 0.1;
  const Json json = to_json(Answer{"7", 3, {}, {}, predict});
  EXPECT_EQ(json["id"], "7");
  EXPECT_EQ(json["predict"]["outcomes"][0]["name"], "in");
  EXPECT_EQ(json["predict"]["outcomes"][0]["group"], "where");
  EXPECT_EQ(json["predict"]["outcomes"][0]["probability"], 0.25);
  EXPECT_EQ(json["predict"]["outcomes"][0]["interval"], Json::array({0.2, 0.3}));
  EXPECT_FALSE(json["predict"]["outcomes"][1].contains("group"));
  EXPECT_EQ(json["predict"]["instances"], 512);
  EXPECT_FALSE(json.contains("error"));
}

TEST(JsonLaws, ErrorsOfAnswersKeepTheirCodeAndText) {
  using core::StatusCode;
  for (const StatusCode code :
       {StatusCode::kInvalidInput, StatusCode::kNotFound, StatusCode::kDataLoss, StatusCode::kUnsupported,
        StatusCode::kUnavailable, StatusCode::kResourceExhausted, StatusCode::kCancelled}) {
    // Texts that look like another code, and one that JSON has to escape.
    for (const std::string text : {"there is no object 'mug'", "unavailable: later", "a \"quote\"\n\xc3\xa9", ""}) {
      Answer answer;
      answer.id = "8";
      answer.error = core::Status(code, text);
      const Json json = Json::parse(to_json(answer).dump());
      EXPECT_EQ(json["error"], text);
      EXPECT_TRUE(json["code"].is_string());
      EXPECT_EQ(error_from_json(json), answer.error) << json;
    }
  }
  EXPECT_TRUE(error_from_json(to_json(Answer{"8", 0, {}, {}, WhereAnswer{}})).ok());
}

TEST(ErrorFromJson, TakesErrorsOfOthersForBadInput) {
  EXPECT_EQ(error_from_json(Json::parse(R"({"error": "no"})")), core::invalid_input("no"));
  EXPECT_EQ(error_from_json(Json::parse(R"({"error": "no", "code": "tired"})")), core::invalid_input("no"));
  EXPECT_EQ(error_from_json(Json::parse(R"({"error": "no", "code": 3})")), core::invalid_input("no"));
  EXPECT_EQ(error_from_json(Json::parse(R"({"error": {"why": 1}})")), core::invalid_input(R"({"why":1})"));
  EXPECT_TRUE(error_from_json(Json::parse(R"({"code": "not_found"})")).ok());
  EXPECT_TRUE(error_from_json(Json::parse("[1]")).ok());
}

TEST(AnswerToJson, TellsWhoSimulatedAndWhyNotInLockstep) {
  PredictAnswer predict;
  EXPECT_FALSE(to_json(Answer{"", 0, {}, {}, predict})["predict"].contains("stepper"));
  predict.stepper = "lockstep";
  EXPECT_EQ(to_json(Answer{"", 0, {}, {}, predict})["predict"]["stepper"], Json::parse(R"({"name": "lockstep"})"));
  predict.stepper = "bullet";
  predict.not_lockstep = "five objects";
  EXPECT_EQ(to_json(Answer{"", 0, {}, {}, predict})["predict"]["stepper"],
            Json::parse(R"({"name": "bullet", "not_lockstep": "five objects"})"));
}

TEST(AnswerToJson, TellsWhatStabilityRestsOn) {
  StabilityAnswer stability;
  stability.object = "cup";
  stability.instances = 64;
  stability.failed_instances = 3;
  stability.converged = true;
  stability.stopped = "converged";
  stability.stepper = "lockstep";
  stability.remarks = {"3 of 64 instances failed"};
  const Json json = to_json(Answer{"", 0, {}, {}, stability})["stability"];
  EXPECT_EQ(json["instances"], 64);
  EXPECT_EQ(json["failed_instances"], 3);
  EXPECT_EQ(json["converged"], true);
  EXPECT_EQ(json["stopped"], "converged");
  EXPECT_EQ(json["stepper"], Json::parse(R"({"name": "lockstep"})"));
  EXPECT_EQ(json["remarks"], Json::parse(R"(["3 of 64 instances failed"])"));
}

TEST(AnswerToJson, WritesImagesInBase64) {
  ViewAnswer view;
  view.depth = geometry::DepthImage(2, 1, 1.0F);  // 00 00 80 3f twice
  view.labels = geometry::LabelImage(1, 1, std::uint16_t{0x0102});
  const Json json = to_json(Answer{"", 0, {}, {}, view})["view"];
  EXPECT_EQ(json["depth"]["base64"], "AACAPwAAgD8=");
  EXPECT_EQ(json["labels"]["base64"], "AgE=");
  EXPECT_EQ(json["depth"]["encoding"], "32FC1");
}

TEST(AnswerToJson, WritesCompactImagesInWholeNumbers) {
  ViewAnswer view;
  view.compact = true;
  view.depth = geometry::DepthImage(1, 1, 0.513F);            // 513 mm = 01 02 in little-endian order
  view.depth_deviation = geometry::DepthImage(1, 1, 100.0F);  // more than 16 bits hold
  view.presence = geometry::Image<float>(1, 1, 1.0F);
  const Json json = to_json(Answer{"", 0, {}, {}, view})["view"];
  EXPECT_EQ(json["depth"]["encoding"], "16UC1");
  EXPECT_EQ(json["depth"]["scale"], 0.001);
  EXPECT_EQ(json["depth"]["base64"], "AQI=");
  EXPECT_EQ(json["depth_deviation"]["base64"], "//8=");
  EXPECT_EQ(json["presence"]["encoding"], "mono8");
  EXPECT_EQ(json["presence"]["base64"], "/w==");
  EXPECT_FALSE(json.contains("color"));
}

}  // namespace
}  // namespace prescene::belief
