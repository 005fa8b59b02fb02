// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/view/recording_view.h"

#include <gmock/gmock.h>

#include <set>

#include "prescene/interfaces/images/jpeg.h"
#include "prescene/service/view/step_store.h"
#include "tests/service/view/page_client.h"

namespace prescene::service::recording_view_test {
namespace {

using nlohmann::ordered_json;
using ::testing::HasSubstr;

std::unique_ptr<RecordingView> view_of(std::uint64_t steps, Backends& backends, std::size_t belief_bytes = 1 << 20) {
  const ShownStep first = tests::shown_step(1);
  RecordingViewOptions options;
  options.view.port = 0;
  options.title = "box.mcap";
  options.most_belief_bytes = belief_bytes;
  auto view = RecordingView::create(first.belief->scene, options, backends, {});
  EXPECT_TRUE(view.ok()) << view.status().message();
  for (std::uint64_t i = 0; i < steps; ++i) EXPECT_TRUE((*view)->add(tests::shown_step(i + 1)).ok());
  return *std::move(view);
}

TEST(RecordingView, ShowsStepsInAnyOrder) {
  core::ThreadPool pool(1);
  Backends backends(pool);
  const auto view = view_of(5, backends);
  view->finish({"One message was refused."});
  tests::PageClient page(view->port());
  EXPECT_EQ(page.next("hello")["title"], "box.mcap");
  EXPECT_EQ(page.next("scene")["objects"][0]["name"], "box");
  const ordered_json history = page.next("history");
  EXPECT_EQ(history["columns"][0], "box/state");
  EXPECT_EQ(history["rows"].size(), 5U);
  EXPECT_EQ(history["objects"][0], "box");
  ASSERT_EQ(history["runs"].size(), 1U);
  EXPECT_EQ(history["runs"][0][1], 0);
  const ordered_json extent = page.next("extent");
  EXPECT_EQ(extent["steps"], 5);
  EXPECT_EQ(extent["done"], true);
  EXPECT_EQ(extent["remarks"][0], "One message was refused.");
  for (const int index : {3, 0, 4}) {
    page.say({{"op", "show"}, {"index", index}});
    const ordered_json step = page.next("step");
    EXPECT_EQ(step["index"], index);
    EXPECT_EQ(step["step"], index + 1);
    EXPECT_DOUBLE_EQ(step["objects"][0]["pose"][0].get<double>(), 0.01 * (index + 1));
    ASSERT_GT(page.picture.size(), 16U);
    EXPECT_EQ(page.picture[0], 1);
    EXPECT_EQ(page.picture[8], index);
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(page.picture.data());
    const auto picture = interfaces::decode_jpeg({bytes + 16, page.picture.size() - 16});
    ASSERT_TRUE(picture.ok()) << picture.status().message();
    EXPECT_EQ((*picture).width(), 40);
  }
}

TEST(RecordingView, AnswersFromTheBeliefThatIsShown) {
  core::ThreadPool pool(2);
  Backends backends(pool);
  const auto view = view_of(5, backends);
  tests::PageClient page(view->port());
  page.say({{"op", "ask"}, {"number", 7}, {"index", 2}, {"question", {{"where", {{"object", "box"}}}}}});
  const ordered_json answer = page.next("answer");
  EXPECT_EQ(answer["number"], 7);
  EXPECT_EQ(answer["answer"]["step"], 3);
  EXPECT_EQ(answer["answer"]["where"]["items"][0]["object"], "box");
  page.say({{"op", "ask"},
            {"number", 8},
            {"index", 2},
            {"question", {{"stability", {{"object", "box"}, {"effort", {{"exact_instances", 16}}}}}}}});
  EXPECT_TRUE(page.next("answer")["answer"].contains("stability"));
}

// Where not all beliefs fit, the nearest one before is asked, and the answer says which.
TEST(RecordingView, KeepsFewerBeliefsOfALongRun) {
  core::ThreadPool pool(1);
  Backends backends(pool);
  const auto view = view_of(33, backends, 9 * sizeof(belief::Particle) + 8 * sizeof(belief::ObjectBelief));
  tests::PageClient page(view->port());
  std::set<int> steps;
  for (int index = 0; index < 33; ++index) {
    page.say({{"op", "ask"}, {"number", index}, {"index", index}, {"question", {{"where", ordered_json::object()}}}});
    const int step = page.next("answer")["answer"]["step"].get<int>();
    EXPECT_LE(step, index + 1);
    steps.insert(step);
  }
  EXPECT_EQ(*steps.begin(), 1);
  EXPECT_GT(steps.size(), 2U);
  EXPECT_LT(steps.size(), 17U);
}

TEST(RecordingView, WhatMakesNoSenseDoesNoHarm) {
  core::ThreadPool pool(1);
  Backends backends(pool);
  const auto view = view_of(2, backends);
  tests::PageClient page(view->port());
  for (const char* text : {"", "{", "[]", "3", R"({"op": 3})", R"({"op": "unknown"})", R"({"op": "show"})",
                           R"({"op": "show", "index": -1})", R"({"op": "show", "index": 99})",
                           R"({"op": "show", "index": 1e300})", R"({"op": "ask"})"})
    page.say_text(text);
  EXPECT_THAT(page.next("answer")["answer"]["error"].get<std::string>(), HasSubstr("ask: not"));
  page.say({{"op", "ask"}, {"number", 1}, {"index", 0}, {"question", {{"wear", 3}}}});
  EXPECT_TRUE(page.next("answer")["answer"].contains("error"));
  page.say({{"op", "show"}, {"index", 1}});
  EXPECT_EQ(page.next("step")["index"], 1);
}

TEST(StepStore, ReadsWhatWasAdded) {
  const auto store = StepStore::create(10);
  ASSERT_TRUE(store.ok()) << store.status().message();
  ASSERT_TRUE((*store)->add("first", "12345").ok());
  ASSERT_TRUE((*store)->add("second", "67890").ok());  // no room for its picture
  ASSERT_TRUE((*store)->add("", "").ok());
  EXPECT_EQ((*store)->size(), 3U);
  EXPECT_EQ((*store)->pictures_left_out(), 1U);
  EXPECT_EQ((*(*store)->read(0)).picture, "12345");
  EXPECT_EQ((*(*store)->read(1)).text, "second");
  EXPECT_EQ((*(*store)->read(1)).picture, "");
  EXPECT_EQ((*store)->read(3).status().code(), core::StatusCode::kNotFound);
}

}  // namespace
}  // namespace prescene::service::recording_view_test
