// SPDX-License-Identifier: Apache-2.0
// Many questions at once: whose turn it is, who is refused, and what is told before an answer.
#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>

#include "prescene/service/outside_json.h"
#include "query_worker_fixture.h"

namespace prescene::service::query_fairness_test {
namespace {

using ::testing::HasSubstr;
using tests::short_question;
using tests::WorkerUnderTest;

/// Goes on until it is cancelled.
constexpr const char* kEndless = R"({"id": "endless", "predict": {"effort": {"exact_instances": 4000000}}})";

/// What is in work does not end by itself.
QueryWorkerSettings patient(int at_once, std::atomic<bool>& has_begun) {
  QueryWorkerSettings settings;
  settings.at_once = at_once;
  settings.most_seconds = 1e5;
  settings.most_bytes = std::size_t{1} << 40;
  settings.on_progress = [&has_begun](const std::string&) { has_begun = true; };
  return settings;
}

bool is_refusal(const std::string& answer) { return answer.find(kQuestionsWait) != std::string::npos; }

TEST(QueryFairness, AThousandQuestionsOfOneDelayAnothersByOneOfThem) {
  std::atomic<bool> has_begun{false};
  WorkerUnderTest worker(patient(1, has_begun));
  worker.ask(kEndless, "greedy");
  while (!has_begun) std::this_thread::yield();
  constexpr int kAsked = 1000;
  for (int i = 0; i < kAsked; ++i) worker.ask(short_question("g" + std::to_string(i)), "greedy");
  worker.ask(short_question("m"), "modest");
  worker.ask(R"({"cancel": "endless"})", "modest");  // read after the question before it
  std::vector<std::string> order;
  for (std::size_t seen = 1; std::find(order.begin(), order.end(), "m") == order.end(); ++seen) {
    const std::string answer = worker.answers(seen)[seen - 1];
    if (!is_refusal(answer)) order.push_back(id_of(answer));
  }
  // The one in work, at most one of those that wait, and then it is the other's turn.
  ASSERT_LE(order.size(), 3U);
  EXPECT_EQ(order.front(), "endless");
}

TEST(QueryFairness, WhileOnesLongQuestionIsSimulatedAnothersIsAnswered) {
  std::atomic<bool> has_begun{false};
  WorkerUnderTest worker(patient(2, has_begun));
  worker.ask(kEndless, "greedy");
  worker.ask(short_question("next"), "greedy");
  while (!has_begun) std::this_thread::yield();
  for (int i = 0; i < 5; ++i) {
    worker.ask(short_question(std::to_string(i)), "modest");
    const auto answers = worker.answers(static_cast<std::size_t>(i) + 1);
    EXPECT_EQ(id_of(answers.back()), std::to_string(i)) << "of one client, one question at most is in work";
  }
  worker.ask(R"({"cancel": "endless"})", "modest");
  // Another thread may be done with the next one while the first's refusal is on its way.
  const auto answers = worker.answers(7);
  EXPECT_THAT((std::array{id_of(answers[5]), id_of(answers[6])}), testing::UnorderedElementsAre("endless", "next"));
}

TEST(QueryFairness, OfTenThousandQuestionsEachIsAnsweredRefusedWithTheBoundOrCounted) {
  std::atomic<bool> has_begun{false};
  QueryWorkerSettings settings = patient(1, has_begun);
  settings.waiting.of_client = 3;
  WorkerUnderTest worker(settings);
  worker.ask(kEndless, "first");
  while (!has_begun) std::this_thread::yield();
  constexpr std::uint64_t kAsked = 10'000;
  for (std::uint64_t i = 0; i < kAsked; ++i)
    worker.ask(short_question(std::to_string(i)), "client " + std::to_string(i % 10));
  worker.ask(R"({"id": "w", "where": {}})", "eleventh");
  // Thirty wait, which is fewer than may in all.
  const auto fates = [&worker] {
    const QueryCounts counts = worker.counts();
    return counts.refused + counts.unanswered;
  };
  while (fates() < kAsked - 30 || worker.counts().answered < 1) std::this_thread::yield();
  const QueryCounts counts = worker.counts();
  EXPECT_EQ(counts.refused + counts.unanswered, kAsked - 30) << "each client has three that wait";
  EXPECT_EQ(counts.answered, 1U) << "`where`, while all others wait";
  std::size_t of_client = 0;
  for (const std::string& answer : worker.answers(counts.refused + 1)) {
    if (id_of(answer) == "w") continue;
    EXPECT_THAT(answer, HasSubstr(kQuestionsWait));
    EXPECT_THAT(answer, testing::AnyOf(HasSubstr("as many as one client may have"), HasSubstr("as may wait of all")));
    of_client += answer.find("3 questions wait already, as many as one client may have") != std::string::npos;
  }
  EXPECT_GT(of_client, 0U);
}

TEST(QueryFairness, WhereThereIsNoRoomInAllWhoHasMostGivesWay) {
  std::atomic<bool> has_begun{false};
  QueryWorkerSettings settings = patient(1, has_begun);
  settings.waiting.of_all = 4;
  WorkerUnderTest worker(settings);
  worker.ask(kEndless, "first");
  while (!has_begun) std::this_thread::yield();
  for (int i = 0; i < 4; ++i) worker.ask(short_question("g" + std::to_string(i)), "greedy");
  worker.ask(short_question("g4"), "greedy");
  EXPECT_EQ(id_of(worker.answers(1)[0]), "g4");
  worker.ask(short_question("m"), "modest");
  const auto answers = worker.answers(2);
  EXPECT_EQ(id_of(answers[1]), "g3");
  EXPECT_THAT(answers[1], HasSubstr("4 questions wait already, as many as may wait of all clients together"));
}

class QueryStream : public ::testing::Test {
 protected:
  /// All that is told of a question, its answer last; `others` are asked by another client before it.
  std::vector<nlohmann::ordered_json> told_of(const std::string& question,
                                              const std::vector<std::string>& others = {}) {
    std::mutex mutex;
    std::vector<nlohmann::ordered_json> told;
    QueryWorkerSettings settings;
    settings.most_seconds = 1e5;
    settings.on_answer_so_far = [&](const std::string& answer) {
      const std::lock_guard lock(mutex);
      told.push_back(parse_or_discard(answer));
    };
    const std::string id = id_of(question);
    WorkerUnderTest worker(settings, {}, {}, [&](const std::string& answer) {
      const std::lock_guard lock(mutex);
      if (id_of(answer) == id) told.push_back(parse_or_discard(answer));
    });
    for (const std::string& other : others) worker.ask(other, "other");
    worker.ask(question);
    static_cast<void>(worker.answers(1 + others.size()));
    const std::lock_guard lock(mutex);
    return told;
  }
};

TEST_F(QueryStream, TheAnswerIsTheSameButForSayingThatItIsFinal) {
  const auto without_times = [](nlohmann::ordered_json document) {
    for (const char* time : {"wall_seconds", "cpu_seconds"}) document["predict"].erase(time);
    document.erase("final");
    return document;
  };
  const std::string rest = R"("predict": {"effort": {"exact_instances": 300}}})";
  const auto plain = told_of(R"({"id": "q", )" + rest);
  ASSERT_EQ(plain.size(), 1U);
  EXPECT_FALSE(plain[0].contains("final"));
  for (const auto& others : {std::vector<std::string>{}, {short_question("a"), short_question("b")}}) {
    const auto streamed = told_of(R"({"id": "q", "stream": true, )" + rest, others);
    ASSERT_GE(streamed.size(), 2U);
    EXPECT_EQ(without_times(streamed.back()), without_times(plain[0]));
    EXPECT_EQ(streamed.back().at("final"), true);
    for (std::size_t i = 0; i + 1 < streamed.size(); ++i) {
      EXPECT_EQ(streamed[i].at("final"), false);
      EXPECT_EQ(streamed[i].at("id"), "q");
      EXPECT_EQ(streamed[i].at("predict").at("stopped"), "");
    }
    EXPECT_EQ(streamed.front().at("predict").at("instances"), 16);
  }
}

TEST_F(QueryStream, WithoutAnIdNothingIsToldBeforeTheAnswer) {
  const auto told = told_of(R"({"stream": true, "stability": {"object": "box", "effort": {"exact_instances": 8}}})");
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].at("final"), true);
}

}  // namespace
}  // namespace prescene::service::query_fairness_test
