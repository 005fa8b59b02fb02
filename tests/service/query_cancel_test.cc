// SPDX-License-Identifier: Apache-2.0
// Questions that nobody waits for any more, and how far others are.
#include <gmock/gmock.h>

#include <atomic>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>

#include "prescene/service/outside_json.h"
#include "query_worker_fixture.h"

namespace prescene::service::query_cancel_test {
namespace {

using ::testing::HasSubstr;
using ::testing::Key;
using ::testing::UnorderedElementsAre;
using tests::short_question;
using tests::WorkerUnderTest;

/// Goes on until it is cancelled.
constexpr const char* kEndless = R"({"id": "endless", "predict": {"effort": {"exact_instances": 4000000}}})";

/// What is in work does not end by itself.
QueryWorkerSettings patient() {
  QueryWorkerSettings settings;
  settings.most_seconds = 1e5;
  settings.most_bytes = std::size_t{1} << 40;
  return settings;
}

std::string code_of(const std::string& answer) { return parse_or_discard(answer).value("code", ""); }

TEST(QueryCancel, EndsWhatIsSimulatedAndTheNextQuestionIsAnswered) {
  std::atomic<bool> has_begun{false};
  QueryWorkerSettings settings = patient();
  settings.on_progress = [&](const std::string&) { has_begun = true; };
  WorkerUnderTest worker(settings);
  worker.ask(kEndless);
  worker.ask(short_question("next"));
  while (!has_begun) std::this_thread::yield();
  worker.ask(R"({"cancel": "endless"})");
  const auto answers = tests::by_id(worker.answers(2));
  ASSERT_THAT(answers, UnorderedElementsAre(Key("endless"), Key("next")));
  const auto ended = parse_or_discard(answers.at("endless"));
  if (ended.contains("predict"))
    EXPECT_LT(ended["predict"]["instances"].get<int>(), 4000000) << "made of what was simulated";
  else
    EXPECT_EQ(code_of(answers.at("endless")), "cancelled");
  EXPECT_THAT(answers.at("next"), HasSubstr("stable"));
  EXPECT_EQ(worker.counts().cancels, 1U);
  EXPECT_EQ(worker.counts().answered + worker.counts().refused, 2U);
}

TEST(QueryCancel, WhatWaitsIsNeverBegun) {
  WorkerUnderTest worker(patient());
  worker.ask(kEndless);
  worker.ask_at_once({R"({"id": "a", "stability": {"object": "box"}})",
                      R"({"id": "b", "stability": {"object": "box"}})", R"({"cancel": "a"})"});
  const auto answers = worker.answers(1);
  EXPECT_EQ(id_of(answers[0]), "a");
  EXPECT_EQ(code_of(answers[0]), "cancelled");
  worker.ask(R"({"cancel": "endless"})");
  EXPECT_THAT(tests::by_id(worker.answers(3)), UnorderedElementsAre(Key("a"), Key("endless"), Key("b")));
  EXPECT_EQ(worker.counts().answered + worker.counts().refused, 3U);
}

TEST(QueryCancel, IsAnsweredUnderAnIdOfItsOwn) {
  WorkerUnderTest worker(patient());
  worker.ask(R"({"id": "1", "where": {}})");
  static_cast<void>(worker.answers(1));
  worker.ask(R"({"cancel": "1"})");  // late, and nobody wants to hear of it
  worker.ask(R"({"cancel": "1", "id": "c"})");
  const auto late = worker.answers(2)[1];
  EXPECT_EQ(id_of(late), "c");
  EXPECT_EQ(code_of(late), "not_found");
  worker.ask(kEndless);
  worker.ask(R"({"id": "a", "stability": {"object": "box"}})");
  worker.ask(R"({"cancel": "a", "id": "d"})");
  const auto answers = worker.answers(4);
  EXPECT_EQ(id_of(answers[2]), "a");
  EXPECT_EQ(parse_or_discard(answers[3]), parse_or_discard(R"({"id": "d", "cancelled": "a"})"));
}

TEST(QueryCancel, OfNoIdIsRefused) {
  WorkerUnderTest worker({});
  for (const char* wrong : {R"({"cancel": ""})", R"({"cancel": 7})", R"({"id": "c", "cancel": "1", "where": {}})"})
    worker.ask(wrong);
  const auto answers = worker.answers(3);
  for (const std::string& answer : answers) EXPECT_THAT(answer, HasSubstr("give the id of a question"));
  EXPECT_EQ(id_of(answers[2]), "c");
  EXPECT_EQ(worker.counts().cancels, 0U);
  EXPECT_EQ(worker.counts().refused, 3U);
}

// Cancelled at any moment, each question has one answer.
TEST(QueryCancel, WheneverItComesEachQuestionHasOneAnswer) {
  WorkerUnderTest worker({});
  constexpr int kQuestions = 30;  // as many requests and questions find room
  std::thread canceller([&worker] {
    for (int i = 0; i < kQuestions; ++i) worker.ask(R"({"cancel": ")" + std::to_string(i) + "\"}");
  });
  int asked = 0;
  for (; asked < kQuestions; ++asked)
    worker.ask(R"({"id": ")" + std::to_string(asked) +
               R"(", "stability": {"object": "box", "effort": {"exact_instances": 20}}})");
  canceller.join();
  const auto done = [&] {
    const QueryCounts counts = worker.counts();
    return counts.answered + counts.refused + counts.unanswered + counts.repeated >= kQuestions;
  };
  while (!done()) std::this_thread::yield();
  const QueryCounts counts = worker.counts();
  EXPECT_EQ(counts.answered + counts.refused + counts.unanswered + counts.repeated,
            static_cast<std::uint64_t>(kQuestions));
  EXPECT_EQ(counts.failed, 0U);
}

TEST(QueryProgress, IsToldOfQuestionsWithAnId) {
  std::mutex mutex;
  std::vector<nlohmann::ordered_json> told;
  QueryWorkerSettings settings;
  settings.on_progress = [&](const std::string& progress) {
    const std::lock_guard lock(mutex);
    told.push_back(parse_or_discard(progress));
  };
  {
    WorkerUnderTest worker(settings);
    worker.ask(R"({"stability": {"object": "box"}})");
    worker.ask(R"({"id": "w", "where": {}})");
    worker.ask(R"({"id": "p", "predict": {"effort": {"exact_instances": 2000}}})");
    static_cast<void>(worker.answers(3));
  }
  ASSERT_FALSE(told.empty());
  for (const auto& at : told) {
    EXPECT_EQ(at.value("id", ""), "p");
    EXPECT_GE(at.at("fraction").get<double>(), 0.0);
    EXPECT_LE(at.at("fraction").get<double>(), 1.0);
  }
  EXPECT_EQ(told.front().at("fraction"), 0.0);
}

}  // namespace
}  // namespace prescene::service::query_cancel_test
