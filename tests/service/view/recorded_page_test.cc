// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/view/recorded_page.h"

#include <gmock/gmock.h>

#include <cstdint>
#include <string>

#include "prescene/core/text.h"
#include "tests/interfaces/ros_messages/sha256.h"
#include "tests/service/view/page_client.h"

namespace prescene::service::recorded_page_test {
namespace {

using nlohmann::ordered_json;
using ::testing::HasSubstr;
using ::testing::Not;

std::string between(const std::string& text, const std::string& begin, const std::string& end) {
  const std::size_t from = text.find(begin);
  if (from == std::string::npos) return "";
  return text.substr(from + begin.size(), text.find(end, from + begin.size()) - from - begin.size());
}

/// What a browser reads: the data between its tags.
ordered_json data_of(const interfaces::PageBlock& page) {
  return ordered_json::parse(between(page.html, "id=\"recorded\">", "</script>"), nullptr, false);
}

/// Of base64, by the definition: four digits of six bits are three bytes.
std::string hash_in_base64(const std::string& text) {
  const std::string hex = tests::sha256(text);
  std::vector<std::uint8_t> bytes;
  for (std::size_t i = 0; i < hex.size(); i += 2)
    bytes.push_back(static_cast<std::uint8_t>(std::stoi(hex.substr(i, 2), nullptr, 16)));
  return core::base64(bytes);
}

TEST(RecordedPage, HoldsEachStepAsTheLiveViewSendsIt) {
  RecordedPage page({.title = "box.mcap"});
  for (std::uint64_t i = 0; i < 5; ++i) page.add(tests::shown_step(i + 1));
  page.add_answer(R"({"step": 5, "where": {"items": []}})");
  page.add_answer("{");
  const ordered_json data = data_of(page.page());
  EXPECT_EQ(data["title"], "box.mcap");
  EXPECT_EQ(data["count"], 5);
  EXPECT_TRUE(data["remarks"].empty());
  ASSERT_EQ(data["steps"].size(), 5U);
  ASSERT_EQ(data["pictures"].size(), 5U);
  for (std::uint64_t i = 0; i < 5; ++i) {
    const ShownStep shown = tests::shown_step(i + 1);
    ordered_json expected = step_document(shown, summary_of(shown), i);
    expected["time"] = 0.1 * static_cast<double>(i);
    ordered_json given = data["steps"][i];
    EXPECT_NEAR(given["time"].get<double>(), expected["time"].get<double>(), 1e-9);
    given["time"] = expected["time"];
    EXPECT_EQ(given, expected);
    EXPECT_EQ(data["pictures"][i]["index"], i);
  }
  EXPECT_EQ(data["history"]["rows"].size(), 5U);
  EXPECT_EQ(data["history"]["runs"].size(), 1U);
  ASSERT_EQ(data["answers"].size(), 1U);
  EXPECT_EQ(data["answers"][0]["index"], 4);
  EXPECT_EQ(data["answers"][0]["answer"]["step"], 5);
}

// The policy of a report allows the script by its hash: another byte, and it would not run.
TEST(RecordedPage, TheHashIsThatOfItsOneScript) {
  const interfaces::PageBlock page = page_with_data("{}");
  const std::string script = between(page.html, "<script type=\"module\">", "</script>");
  EXPECT_THAT(script, HasSubstr("class RecordedProgram"));
  EXPECT_THAT(script, Not(HasSubstr("\nimport ")));
  EXPECT_THAT(script, Not(HasSubstr("\nexport ")));
  ASSERT_EQ(page.script_hashes.size(), 1U);
  EXPECT_EQ(page.script_hashes[0], hash_in_base64(script));
  EXPECT_THAT(page.html, Not(HasSubstr(" src=")));
  EXPECT_THAT(page.html, Not(HasSubstr(" href=")));
}

TEST(RecordedPage, HostileNamesStayTexts) {
  const std::string nasty = "</script><script>alert('1')</script>\"&<!--\xff\xe2\x80\xa8";
  RecordedPage page({.title = nasty});
  ShownStep shown = tests::shown_step(1);
  auto scene = std::make_shared<belief::Scene>(*shown.belief->scene);
  scene->name = nasty;
  scene->objects[0].name = nasty;
  auto belief = std::make_shared<belief::Belief>(*shown.belief);
  belief->scene = scene;
  belief->objects[0].name = nasty;
  shown.belief = belief;
  page.add(shown);
  page.add_answer(belief::json_text({{"error", nasty}}));
  const interfaces::PageBlock block = page.page();
  const ordered_json data = data_of(block);
  ASSERT_TRUE(data.is_object());
  EXPECT_THAT(data["scene"]["objects"][0]["name"].get<std::string>(), HasSubstr("</script><script>alert('1')"));
  std::size_t scripts = 0;
  for (std::size_t at = 0; (at = block.html.find("<script", at)) != std::string::npos; ++at) ++scripts;
  EXPECT_EQ(scripts, 2U) << "the data and the page's own";
  EXPECT_EQ(between(block.html, "id=\"recorded\">", "</script>").find('<'), std::string::npos);
  interfaces::ReportContents report;
  report.sections.push_back({"", {block}});
  const std::string html = interfaces::report_html(report);
  EXPECT_THAT(html, Not(HasSubstr("<script")));
  EXPECT_THAT(html, HasSubstr("script-src 'sha256-" + block.script_hashes[0] + "';"));
}

TEST(RecordedPage, WithoutAStepThereIsNone) {
  RecordedPage page({.title = "empty"});
  page.add_answer(R"({"where": {}})");
  EXPECT_TRUE(page.page().html.empty());
}

// However long the recording, the data are bounded, and the page says what is left out. Steps at which a state changes
// are among those that are kept.
TEST(RecordedPage, OfALongRecordingEveryFewStepsAreKept) {
  constexpr std::size_t kStepBytes = 40'000, kPictureBytes = 30'000, kAnswerBytes = 100;
  RecordedPage page({"long", kStepBytes, kPictureBytes, kAnswerBytes});
  for (std::uint64_t i = 0; i < 600; ++i) {
    ShownStep shown = tests::shown_step(i + 1);
    auto belief = std::make_shared<belief::Belief>(*shown.belief);
    if (i == 301) belief->objects[0].state = belief::TrackState::kDoubtful;
    shown.belief = belief;
    page.add(shown);
  }
  page.add_answer(belief::json_text({{"error", std::string(200, 'x')}}));
  const ordered_json data = ordered_json::parse(page.data());
  EXPECT_EQ(data["count"], 600);
  EXPECT_LT(data["steps"].size(), 300U);
  EXPECT_LE(data["steps"].dump().size(), kStepBytes + data["steps"].size() + 2);
  EXPECT_LE(data["pictures"].dump().size(), kPictureBytes + data["pictures"].size() + 2);
  EXPECT_EQ(data["steps"][0]["index"], 0);
  bool has_change = false, has_return = false;
  for (const ordered_json& step : data["steps"]) {
    has_change = has_change || step["index"] == 301;
    has_return = has_return || step["index"] == 302;
  }
  EXPECT_TRUE(has_change);
  EXPECT_TRUE(has_return);
  ASSERT_EQ(data["remarks"].size(), 3U);
  EXPECT_THAT(data["remarks"][0].get<std::string>(),
              HasSubstr("Of 600 steps " + std::to_string(data["steps"].size()) + " are kept here: one in "));
  EXPECT_EQ(data["remarks"][2], "1 long answers are left out.");
  EXPECT_TRUE(data["answers"].empty());
}

// Where something changes at each step, most of the changes are left out as well: the page says how many.
TEST(RecordedPage, SaysHowManyChangesAreLeftOut) {
  RecordedPage page({"restless", 40'000, 30'000, 100});
  for (std::uint64_t i = 0; i < 400; ++i) {
    ShownStep shown = tests::shown_step(i + 1);
    auto belief = std::make_shared<belief::Belief>(*shown.belief);
    if (i % 2 == 1) belief->objects[0].state = belief::TrackState::kDoubtful;
    shown.belief = belief;
    page.add(shown);
  }
  const ordered_json data = ordered_json::parse(page.data());
  ASSERT_EQ(data["remarks"].size(), 2U);
  // All steps change a state, so that all that are not kept are such.
  const std::size_t left_out = 400 - data["steps"].size();
  EXPECT_THAT(data["remarks"][0].get<std::string>(),
              HasSubstr("a state changed (" + std::to_string(left_out) + " of these are left out, too)."));
}

// The law behind it: never more bytes than allowed; what is kept is in order, evenly spread, with the marked ones.
TEST(ThinnedTexts, AreBoundedAndEvenlySpread) {
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    core::RandomStream stream(seed, core::Purpose::kTest, 0, 0);
    constexpr std::size_t kMost = 2000;
    ThinnedTexts texts(kMost), asked_first(kMost);
    std::vector<std::uint64_t> marked;
    const double share = seed % 3 == 0 ? 0.5 : 0.002;  // more marked ones than there is room for, or few
    for (std::uint64_t i = 0; i < 3000; ++i) {
      const bool is_marked = stream.uniform() < share;
      if (is_marked) marked.push_back(i);
      const std::string text(1 + stream.uniform_below(40), 'x');
      texts.add(text, is_marked);
      asked_first.wants_next(is_marked) ? asked_first.add(text, is_marked) : asked_first.skip();
      ASSERT_LE(texts.bytes(), kMost);
      ASSERT_EQ(texts.kept().size(), asked_first.kept().size());
      ASSERT_EQ(texts.added(), asked_first.added());
    }
    std::size_t bytes = 0, marked_kept = 0;
    std::vector<std::uint64_t> numbers;
    for (const ThinnedTexts::Text& one : texts.kept()) {
      bytes += one.text.size();
      marked_kept += one.was_marked ? 1 : 0;
      EXPECT_TRUE(numbers.empty() || numbers.back() < one.number);
      EXPECT_TRUE(one.is_marked || one.number % texts.stride() == 0);
      numbers.push_back(one.number);
    }
    EXPECT_EQ(bytes, texts.bytes());
    EXPECT_EQ(marked_kept + texts.marked_left_out(), marked.size());
    EXPECT_EQ(texts.added(), 3000U);
    for (std::uint64_t i = 0; i < 3000; i += texts.stride()) EXPECT_THAT(numbers, ::testing::Contains(i));
    if (share < 0.1) {
      for (const std::uint64_t one : marked) EXPECT_THAT(numbers, ::testing::Contains(one));
    }
  }
  ThinnedTexts small(10);
  small.add(std::string(11, 'x'), true);
  EXPECT_TRUE(small.kept().empty());
  EXPECT_EQ(small.bytes(), 0U);
  EXPECT_EQ(small.marked_left_out(), 1U);
}

}  // namespace
}  // namespace prescene::service::recorded_page_test
