// SPDX-License-Identifier: Apache-2.0
#include "prescene/belief/query_limits.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "prescene/belief/explain_question.h"
#include "prescene/belief/json.h"
#include "prescene/belief/why_question.h"
#include "prescene/core/utf8.h"

namespace prescene::belief {
namespace {

using nlohmann::ordered_json;
using ::testing::HasSubstr;

std::string message(const std::string& question) { return query_from_json(question).status().message(); }

TEST(JsonText, NeverFailsAndIsTextWhateverADocumentHolds) {
  const ordered_json bad = {{"frame_id", "\xff"}, {"\xc3", {"cut \xe2\x82", "fine \xc3\xbc"}}};
  const std::string text = json_text(bad);
  EXPECT_TRUE(core::is_utf8(text)) << text;
  EXPECT_THAT(text, HasSubstr("\xef\xbf\xbd"));
  EXPECT_THAT(text, HasSubstr("fine \xc3\xbc"));
  const ordered_json read = *parse_json(text);
  EXPECT_EQ(read.at("frame_id"), "\xef\xbf\xbd");
}

TEST(JsonText, NumbersThatAreNotFiniteAreNull) {
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  EXPECT_EQ(json_text({std::nan(""), kInfinite, -kInfinite, 0.5}), "[null,null,null,0.5]");
  EXPECT_EQ(json_text({{"a", 1}}, 1), "{\n \"a\": 1\n}");
}

TEST(ParseJson, TextThatIsNotUtf8IsRefused) {
  for (const char* bad : {"{\"where\": {\"object\": \"\xff\"}}", "{\"id\": \"\xc0\x80\", \"where\": {}}", "\xff"})
    EXPECT_EQ(query_from_json(bad).status().code(), core::StatusCode::kInvalidInput);
}

// Every new key is compared with all before it: a megabyte of keys would take a minute.
TEST(ParseJson, AnObjectOfVeryManyKeysIsRefusedBeforeItIsRead) {
  const auto keys = [](int count) {
    std::string text = "{";
    for (int i = 0; i < count; ++i) text += (i > 0 ? ",\"k" : "\"k") + std::to_string(i) + "\":0";
    return text + "}";
  };
  EXPECT_TRUE(parse_json(keys(1000)).ok());
  EXPECT_TRUE(parse_json("[" + keys(1000) + "," + keys(1000) + "]").ok());
  EXPECT_THAT(parse_json(keys(90000)).status().message(), HasSubstr("more than 1024 keys"));
  EXPECT_THAT(parse_json("[[" + keys(90000) + "]]").status().message(), HasSubstr("more than 1024 keys"));
  EXPECT_TRUE(parse_json(R"({"a": ")" + std::string(5000, ':') + "\"}").ok()) << "these stand in a text";
}

TEST(QueryLimits, TheEndsOfARangeBelongToItAndWhatIsNotANumberDoesNot) {
  for (const ScalarRange& range : {kTolerances, kConfidences, kInstances, kWallSeconds, kDurations, kMoves, kTurns}) {
    EXPECT_TRUE(check_number(range.low, range).ok());
    EXPECT_TRUE(check_number(range.high, range).ok());
    for (const double outside : {std::nextafter(range.low, -1e300), std::nextafter(range.high, 1e300), std::nan(""),
                                 std::numeric_limits<double>::infinity()})
      EXPECT_THAT(check_number(outside, range).message(), HasSubstr(range.remedy)) << outside;
  }
}

TEST(QueryLimits, JsonAndCallersAreBoundByTheSameRanges) {
  Effort effort;
  effort.confidence = 0.9999999999999999;
  EXPECT_THAT(validate(effort).message(), HasSubstr("effort.confidence"));
  EXPECT_THAT(message(R"({"predict": {"effort": {"confidence": 0.9999999999999999}}})"),
              HasSubstr("predict.effort.confidence"));
  for (const char* key : {"tolerance", "confidence", "max_seconds"}) {
    for (const char* value : {"0", "-1", "1e300", "5e-324", "1.0000000000000002e6"})
      EXPECT_THAT(message(std::string(R"({"stability": {"object": "o", "effort": {")") + key + "\": " + value + "}}}"),
                  HasSubstr(std::string("stability.effort.") + key))
          << key << value;
  }
  for (const char* key : {"max_instances", "exact_instances"}) {
    for (const char* value : {"0", "-1", "4194305", "1e9", "18446744073709551615"})
      EXPECT_THAT(message(std::string(R"({"predict": {"effort": {")") + key + "\": " + value + "}}}"),
                  HasSubstr(std::string("predict.effort.") + key));
  }
  EXPECT_THAT(message(R"({"predict": {"duration": 3600.5}})"), HasSubstr("predict.duration"));
  EXPECT_THAT(message(R"({"view": {"time": 3601}})"), HasSubstr("view.time"));
  EXPECT_THAT(message(R"({"predict": {"paths": 1001}})"), HasSubstr("predict.paths"));
  EXPECT_TRUE(query_from_json(R"({"predict": {"effort": {"confidence": 0.9999, "tolerance": 0.0001,
                                  "max_instances": 4194304}, "duration": 3600, "paths": 1000}})")
                  .ok());
}

TEST(QueryLimits, SoAreCountsAndLengths) {
  const auto groups = [](int count) {
    std::string text = R"({"predict": {"exclusive_outcomes": [)";
    for (int i = 0; i < count; ++i)
      text += (i > 0 ? ",{\"name\":\"g" : "{\"name\":\"g") + std::to_string(i) + R"(","object":"o","face_up":true})";
    return text + "]}}";
  };
  EXPECT_TRUE(query_from_json(groups(40)).ok());
  EXPECT_EQ(query_from_json(groups(15000)).status().code(), core::StatusCode::kResourceExhausted);
  EXPECT_THAT(message(groups(50)), HasSubstr("300 outcomes: ask for at most 256"));  // six faces each
  PredictQuery many;
  many.actions.resize(kMostActions + 1);
  EXPECT_THAT(validate(Query{"", many}).message(), HasSubstr("257 actions"));
  PredictQuery conditions;
  conditions.outcomes.push_back({"o", "o", std::vector<Condition>(kMostConditions + 1)});
  EXPECT_THAT(validate(Query{"", conditions}).message(), HasSubstr("conditions"));
  PredictQuery named;
  named.outcomes.push_back({std::string(kLongestName + 1, 'n'), "o", {Condition{}}});
  EXPECT_THAT(validate(Query{"", named}).message(), HasSubstr("129 bytes"));
  EXPECT_TRUE(validate(Query{std::string(kLongestId, 'i'), WhereQuery{}}).ok());
  EXPECT_THAT(validate(Query{std::string(kLongestId + 1, 'i'), WhereQuery{}}).message(), HasSubstr("id"));
  EXPECT_THAT(validate(Query{"\xff", WhereQuery{}}).message(), HasSubstr("UTF-8"));
}

TEST(ExplainQuestion, IsReadAsItIsWritten) {
  ExplainQuestion question;
  question.id = "7";
  question.object = "carton";
  question.seed = 3;
  EXPECT_EQ(*explain_question_from_json(json_text(to_json(question))), question);
  question.from = 2.25;
  question.to = 4.5;
  question.change = true;
  question.wanted = Outcome{"up", "carton", {Condition{UprightWithin{Vector3d::UnitZ(), 0.25}}}};
  question.max_seconds = 2.0;
  EXPECT_EQ(*explain_question_from_json(json_text(to_json(question))), question);
  EXPECT_TRUE(asks_to_explain(json_text(to_json(question))));
  EXPECT_FALSE(asks_to_explain(R"({"where": {"object": "explain"}})"));
  EXPECT_FALSE(asks_to_explain(R"({"explain")"));
}

TEST(ExplainQuestion, NamesWhatIsWrongInIt) {
  const auto refusal = [](const std::string& asked) {
    const auto question = explain_question_from_json(R"({"id": "1", "explain": )" + asked + "}");
    return question ? "" : question.status().message();
  };
  EXPECT_THAT(refusal(R"({"from": 1})"), HasSubstr("'from' and 'to' go together"));
  EXPECT_THAT(refusal(R"({"from": 1, "to": 2, "last": 1})"), HasSubstr("two windows"));
  EXPECT_THAT(refusal(R"({"from": 2, "to": 1})"), HasSubstr("'from' is not before 'to'"));
  EXPECT_THAT(refusal(R"({"last": 0})"), HasSubstr("explain.last"));
  EXPECT_THAT(refusal(R"({"points": 1})"), HasSubstr("explain.points"));
  EXPECT_THAT(refusal(R"({"objct": "a"})"), HasSubstr("did you mean 'object'?"));
  EXPECT_THAT(refusal(R"({"wanted": 3})"), HasSubstr("explain.wanted"));
  EXPECT_THAT(refusal(R"({"wanted": ""})"), HasSubstr("the name is empty"));
  EXPECT_EQ(refusal(R"({"wanted": {"object": "a", "upright": {"within_deg": 5}}})"), "");
  EXPECT_THAT(query_from_json(R"({"explain": {}})").status().message(), HasSubstr("ask a running 'serve'"));
}

TEST(WhyQuestion, IsReadAsItIsWritten) {
  WhyQuestion question;
  question.id = "9";
  question.object = "mug";
  const auto again = [](const WhyQuestion& asked) { return why_question_from_json(json_text(to_json(asked))); };
  EXPECT_EQ(*again(question), question);
  question.against = WhyAgainst::kPose;
  question.X_WO =
      Pose{geometry::Quaterniond(Eigen::AngleAxisd(0.3, Vector3d(1.0, 2.0, 3.0).normalized())), {0.1, 0.2, 0.3}};
  question.last = 1.5;
  question.images = 0;
  question.max_seconds = 2.0;
  question.stream = true;
  EXPECT_EQ(*again(question), question);
  question.last.reset();
  question.from = 2.25;
  question.to = 4.5;
  for (const WhyAgainst against : {WhyAgainst::kAbsence, WhyAgainst::kAlternative}) {
    question.against = against;
    question.X_WO.reset();
    EXPECT_EQ(*again(question), question);
  }
  EXPECT_TRUE(asks_why(json_text(to_json(question))));
  EXPECT_FALSE(asks_why(R"({"where": {"object": "why"}})"));
  EXPECT_FALSE(asks_why(R"({"why")"));
}

TEST(WhyQuestion, NamesWhatIsWrongInIt) {
  const auto refusal = [](const std::string& asked) {
    const auto question = why_question_from_json(R"({"id": "1", "why": )" + asked + "}");
    return question ? "" : question.status().message();
  };
  EXPECT_THAT(refusal("{}"), HasSubstr("object"));
  EXPECT_THAT(refusal(R"({"object": ""})"), HasSubstr("why.object"));
  EXPECT_THAT(refusal(R"({"objct": "a"})"), HasSubstr("object"));
  EXPECT_THAT(refusal(R"({"object": "a", "against": "nothing"})"), HasSubstr("give \"absence\""));
  EXPECT_THAT(refusal(R"({"object": "a", "against": 3})"), HasSubstr("why.against"));
  EXPECT_THAT(refusal(R"({"object": "a", "against": {}})"), HasSubstr("position, rotation"));
  EXPECT_THAT(refusal(R"({"object": "a", "against": {"position": [0, 1e300, 0]}})"),
              HasSubstr("why.against: position"));
  EXPECT_THAT(refusal(R"({"object": "a", "images": 17})"), HasSubstr("why.images"));
  EXPECT_THAT(refusal(R"({"object": "a", "from": 1})"), HasSubstr("'from' and 'to' go together"));
  EXPECT_THAT(refusal(R"({"object": "a", "from": 1, "to": 2, "last": 1})"), HasSubstr("two windows"));
  EXPECT_THAT(refusal(R"({"object": "a", "from": 2, "to": 1})"), HasSubstr("'from' is not before 'to'"));
  EXPECT_EQ(refusal(R"({"object": "a", "against": {"position": [0, 0, 1]}})"), "");
  EXPECT_THAT(query_from_json(R"({"why": {"object": "a"}})").status().message(), HasSubstr("ask a running 'serve'"));
}

TEST(QueryFromJson, AMistakeInAQuestionAboutViewsIsNamedWithItsPlace) {
  const std::string begin = R"({"next_view": {"object": "mug", )";
  EXPECT_THAT(message(R"({"next_view": {"object": "mug", "views": []}})"), HasSubstr("views: there is none"));
  EXPECT_THAT(message(begin + R"("views": [{}]}})"), HasSubstr("next_view.views[0]: the key 'pose' is missing"));
  EXPECT_THAT(message(begin + R"("about": "colour", "views": [{"pose": {"position": [0, 0, 1]}}]}})"),
              HasSubstr("next_view.about"));
  EXPECT_THAT(message(begin + R"("draws": 3, "views": [{"pose": {"position": [0, 0, 1]}}]}})"),
              HasSubstr("next_view.draws"));
  EXPECT_THAT(message(begin + R"("views": [{"pose": {"position": [1e9, 0, 0]}}]}})"), HasSubstr("views[0].pose"));
  const std::string large = R"("intrinsics": {"width": 16000, "height": 16000, "fx": 9})";
  EXPECT_THAT(message(begin + R"("views": [{"pose": {"position": [0, 0, 1]}, )" + large + "}]}}"),
              HasSubstr("views[0].intrinsics"));
  EXPECT_THAT(message(R"({"view": {"detail": ["smell"]}})"), HasSubstr("view.detail[0]"));
  EXPECT_THAT(message(R"({"view": {"intrinsics": {"width": 4, "height": 4, "fx": -1}}})"), HasSubstr("intrinsics"));
  EXPECT_EQ(message(begin + R"("views": [{"pose": {"position": [0, 0, 1]}}]}})"), "");
}

}  // namespace
}  // namespace prescene::belief
