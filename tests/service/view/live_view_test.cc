// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/view/live_view.h"

#include <condition_variable>
#include <mutex>

#include "tests/service/view/page_client.h"

namespace prescene::service::live_view_test {
namespace {

std::unique_ptr<LiveView> live_view() {
  ViewOptions options;
  options.port = 0;
  auto view = LiveView::create(tests::shown_step(1).belief->scene, options, {});
  EXPECT_TRUE(view.ok()) << view.status().message();
  return *std::move(view);
}

TEST(LiveView, ShowsTheNewestStep) {
  const auto view = live_view();
  tests::PageClient page(view->port());
  EXPECT_EQ(page.next("hello")["mode"], "live");
  page.next("history");
  // Steps that come while one is being worked on are replaced by the next; the last one is always shown.
  for (std::uint64_t step = 1; step <= 50; ++step) view->show(tests::shown_step(step));
  std::uint64_t shown = 0;
  while (shown != 50) {
    const std::uint64_t next = page.next("step")["step"].get<std::uint64_t>();
    ASSERT_GT(next, shown);
    shown = next;
  }
  // The picture of a step comes after it, and before the next one.
  view->show(tests::shown_step(51));
  EXPECT_EQ(page.next("step")["step"], 51);
  view->set_health("tracking");
  EXPECT_EQ(page.next("health")["text"], "tracking");
  EXPECT_FALSE(page.picture.empty());
}

TEST(LiveView, AnswersGoToWhoAsked) {
  const auto view = live_view();
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<std::string> questions;
  view->set_asker([&](std::string question) {
    const std::lock_guard lock(mutex);
    questions.push_back(std::move(question));
    changed.notify_all();
  });
  tests::PageClient first(view->port()), second(view->port());
  const auto id_of_next = [&](std::size_t count) {
    std::unique_lock lock(mutex);
    changed.wait(lock, [&] { return questions.size() >= count; });
    return nlohmann::ordered_json::parse(questions.back())["id"].get<std::string>();
  };
  // The id is ours, whatever the page says.
  first.say({{"op", "ask"}, {"number", 5}, {"question", {{"id", "mine"}, {"where", {{"object", "box"}}}}}});
  const std::string first_id = id_of_next(1);
  second.say({{"op", "ask"}, {"number", 5}, {"question", {{"where", {{"object", "box"}}}}}});
  const std::string second_id = id_of_next(2);
  EXPECT_NE(first_id, second_id);
  view->answer(R"({"id":"somebody else's","step":1})");
  view->answer(R"({"id":"view-1","step":1})");
  view->answer(R"({"id":"view-18446744073709551616-1","step":1})");
  view->answer(R"({"id":"view-1-)");
  view->answer(R"({"id":")" + second_id + R"(","step":2})");
  view->answer(R"({"id":")" + first_id + R"(","step":1})");
  const auto one = first.next("answer"), two = second.next("answer");
  EXPECT_EQ(one["number"], 5);
  EXPECT_EQ(one["answer"]["step"], 1);
  EXPECT_EQ(two["answer"]["step"], 2);
  view->set_asker({});
  first.say({{"op", "ask"}, {"number", 6}, {"question", {{"where", nlohmann::ordered_json::object()}}}});
  EXPECT_EQ(first.next("answer")["answer"]["code"], "unavailable");
}

}  // namespace
}  // namespace prescene::service::live_view_test
