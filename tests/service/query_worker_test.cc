// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/live/query_worker.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <new>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <thread>

#include "prescene/core/utf8.h"
#include "prescene/service/outside_json.h"
#include "query_worker_fixture.h"
#include "tests/support/allocations.h"

namespace prescene::service {
namespace {

using ::testing::HasSubstr;
using ::testing::Key;
using ::testing::UnorderedElementsAre;
using tests::short_question;
using tests::WorkerUnderTest;

/// Goes on until the worker's limit, or for ever where there is none.
constexpr const char* kLong = R"({"id": "long", "predict": {"effort": {"exact_instances": 4000000}}})";

/// The long question is not refused for its memory.
QueryWorkerSettings limited_to(double most_seconds) {
  QueryWorkerSettings settings;
  settings.most_seconds = most_seconds;
  settings.most_bytes = std::size_t{1} << 40;
  return settings;
}

nlohmann::ordered_json without_times(const std::string& answer) {
  auto document = parse_or_discard(answer);
  for (const char* task : {"predict", "stability"})
    if (document.contains(task))
      for (const char* time : {"wall_seconds", "cpu_seconds"}) document[task].erase(time);
  return document;
}

/// Stamps count from 1970, which tells nobody anything.
TEST(QueryWorker, WhereTellsInSecondsOfTheSessionWhenParametersWereLearned) {
  constexpr core::TimeNs kBegin = 1'700'000'000'000'000'000;
  const auto learned_s = [](std::optional<double> seconds, bool is_begun) {
    const auto belief = tests::belief_of(tests::kBoxScene);
    belief->step = 9;
    if (seconds) {
      belief->objects[0].physics.lessons = 1;
      belief->objects[0].physics.learned_ns = kBegin + std::llround(1e9 * *seconds);
    }
    WorkerUnderTest worker({}, belief);
    if (is_begun) worker.begin_session(kBegin);
    worker.ask(R"({"where": {}})");
    const auto item = nlohmann::json::parse(worker.answers(1)[0]).at("where").at("items").at(0);
    return item.value("learned_s", nlohmann::json("absent"));
  };
  EXPECT_NEAR(learned_s(12.3, true).get<double>(), 12.3, 1e-6);
  EXPECT_NEAR(learned_s(-4.0, true).get<double>(), -4.0, 1e-6) << "in an earlier session";
  EXPECT_TRUE(learned_s({}, true).is_null());
  EXPECT_EQ(learned_s(12.3, false), "absent");
}

TEST(QueryWorker, NoQuestionKeepsTheOthersWaitingForEver) {
  QueryWorkerSettings settings = limited_to(0.2);
  std::atomic<bool> has_begun{false};
  settings.on_progress = [&has_begun](const std::string&) { has_begun = true; };
  WorkerUnderTest worker(settings);
  worker.ask(kLong);
  while (!has_begun) std::this_thread::yield();
  worker.set_most_seconds(1e5);  // of those after it: a busy machine may take its time for a short one
  worker.ask(short_question("short"));
  const auto answers = tests::by_id(worker.answers(2));
  ASSERT_THAT(answers, UnorderedElementsAre(Key("long"), Key("short")));
  const auto cut = parse_or_discard(answers.at("long"));
  if (cut.contains("predict")) {
    EXPECT_LT(cut["predict"]["instances"].get<int>(), 4000000);
  }
  EXPECT_THAT(answers.at("short"), HasSubstr("stable"));
}

TEST(QueryWorker, WhereIsAnsweredWhileAnotherQuestionIsSimulatedForEver) {
  WorkerUnderTest worker(limited_to(1e5));
  worker.ask(kLong);
  for (int i = 0; i < 20; ++i) worker.ask(R"({"id": "w)" + std::to_string(i) + R"(", "where": {}})");
  const std::vector<std::string> answers = worker.answers(20);
  for (std::size_t i = 0; i < answers.size(); ++i) EXPECT_EQ(id_of(answers[i]), "w" + std::to_string(i));
  EXPECT_EQ(worker.counts().answered, 20u);
  // Here the worker is torn down: the question under way ends with it.
}

TEST(QueryWorker, AnswersAreThoseOfAWorkerThatIsAskedNothingElse) {
  const auto ask = [](bool others) {
    WorkerUnderTest worker(limited_to(1e5));
    std::vector<std::string> questions;
    if (others) questions.assign(10, R"({"where": {}})");
    questions.push_back(R"({"id": "q", "predict": {"effort": {"exact_instances": 100}}})");
    if (others) questions.insert(questions.end(), 10, R"({"where": {"object": "box"}})");
    worker.ask_at_once(questions);
    for (const std::string& answer : worker.answers(questions.size()))
      if (id_of(answer) == "q") return without_times(answer);
    return nlohmann::ordered_json();
  };
  EXPECT_EQ(ask(false), ask(true));
}

TEST(QueryWorker, QuestionsThatFindNoRoomAreRefusedOrCounted) {
  QueryWorkerSettings settings = limited_to(1e5);
  settings.waiting.of_all = 2;
  settings.unread.of_all = 4;
  WorkerUnderTest worker(settings);
  worker.ask(kLong);
  constexpr std::uint64_t kAsked = 3000;
  std::vector<std::string> flood;
  for (std::uint64_t i = 1; i < kAsked; ++i)
    flood.push_back(R"({"id": ")" + std::to_string(i) + R"(", "stability": {"object": "box"}})");
  worker.ask_at_once(flood);
  // One is simulated and two wait, or, where the flood came before the first one was taken, one more finds no room;
  // every other is refused or counted.
  while (worker.counts().refused + worker.counts().unanswered < kAsked - 3) std::this_thread::yield();
  const QueryCounts counts = worker.counts();
  EXPECT_EQ(counts.answered, 0u);
  EXPECT_LE(counts.refused + counts.unanswered, kAsked - 2);
  EXPECT_GT(counts.refused, 0u);
  for (const std::string& answer : worker.answers(counts.refused)) {
    EXPECT_THAT(answer, HasSubstr(kQuestionsWait));
    EXPECT_NE(id_of(answer), "");
  }
}

TEST(QueryWorker, LongQuestionsDoNotFillTheMemoryBeforeTheyAreRead) {
  WorkerUnderTest worker({});
  const std::string huge = R"({"id": "h", "where": {"object": ")" + std::string(std::size_t{30} << 20, 'x') + "\"}}";
  for (int i = 0; i < 3; ++i) worker.ask(huge);
  for (const std::string& answer : worker.answers(3)) EXPECT_THAT(answer, HasSubstr("longer than 1048576 bytes"));
  EXPECT_EQ(worker.counts().refused, 3u);
}

TEST(QueryWorker, OfALongQuestionThatWaitsItsBeginningIsKeptOnly) {
  WorkerUnderTest worker({});
  const std::string huge(std::size_t{30} << 20, 'x');
  const std::vector<std::string> questions(3, huge);
  const std::uint64_t before = tests::heap_bytes();  // 0 under sanitizers
  std::uint64_t waiting = 0;
  worker.ask_at_once(questions, [&] { waiting = tests::heap_bytes(); });
  worker.answers(3);
  EXPECT_LT(waiting, before + huge.size());
}

TEST(QueryWorker, AnExceptionEndsNeitherThread) {
  std::atomic<bool> broken{true};
  const auto belief = tests::belief_of(tests::kBoxScene);
  WorkerUnderTest worker(limited_to(1e5), belief, [&]() -> std::shared_ptr<const belief::Belief> {
    if (broken) throw std::runtime_error("the belief is not there");
    return belief;
  });
  const std::vector<std::string> questions = {R"({"id": "a", "where": {}})", short_question("b")};
  for (const std::string& question : questions) worker.ask(question);
  for (const std::string& answer : worker.answers(2)) EXPECT_THAT(answer, HasSubstr("the belief is not there"));
  EXPECT_EQ(worker.counts().failed, 2u);
  EXPECT_EQ(worker.counts().last_failure, "the belief is not there");
  broken = false;
  for (const std::string& question : questions) worker.ask(question);
  worker.answers(4);
  EXPECT_EQ(worker.counts().answered, 2u);
}

/// Of questions that neither wait nor are worked on.
std::uint64_t settled(const QueryCounts& counts) {
  return counts.answered + counts.refused + counts.unanswered + counts.repeated;
}

TEST(QueryWorker, EachQuestionIsCountedOnceWhateverBecomesOfIt) {
  // What is not handed over, for want of memory or by a bug, is told by its id.
  const auto before = [](const std::string& answer) {
    if (id_of(answer).starts_with("memory")) throw std::bad_alloc();
    if (id_of(answer).starts_with("bug")) throw std::runtime_error("the bus is gone");
  };
  WorkerUnderTest worker(limited_to(0.05), {}, {}, before);
  const std::vector<std::string> questions = {R"({"id": "good", "where": {}})",
                                              R"({"id": "memory 1", "where": {}})",
                                              R"({"id": "bug 1", "where": {}})",
                                              R"({"id": "refused", "where": {"object": "nothing"}})",
                                              R"({"id": "memory 2", "wher": {}})",
                                              R"({"id": "bug 2", "wher": {}})",
                                              R"({"id": "bug 3", "stability": {"object": "box"}})",
                                              "not JSON"};
  for (const std::string& question : questions) worker.ask(question);
  while (settled(worker.counts()) < questions.size()) std::this_thread::yield();
  // The last one may just be on its way.
  ASSERT_EQ(worker.answers(3).size(), 3u);
  while (worker.counts().unanswered < 5) std::this_thread::yield();
  const QueryCounts counts = worker.counts();
  EXPECT_EQ(counts.answered, 1u);
  EXPECT_EQ(counts.refused, 2u);
  EXPECT_EQ(counts.unanswered, 5u);
  EXPECT_EQ(counts.repeated, 0u);
  EXPECT_EQ(counts.failed, 3u) << "that memory ends is no bug";
  EXPECT_EQ(counts.last_failure, "the bus is gone");
  EXPECT_GT(counts.last_failure_ns, 0);
}

TEST(QueryWorker, WhereMemoryEndsAQuestionIsRefusedAndNoBugCounted) {
  WorkerUnderTest worker(limited_to(0.05), {},
                         []() -> std::shared_ptr<const belief::Belief> { throw std::bad_alloc(); });
  worker.ask(R"({"id": "a", "where": {}})");
  worker.ask(R"({"id": "b", "stability": {"object": "box"}})");
  for (const std::string& answer : worker.answers(2)) EXPECT_THAT(answer, HasSubstr("resource_exhausted"));
  EXPECT_EQ(worker.counts().refused, 2u);
  EXPECT_EQ(worker.counts().failed, 0u);
}

TEST(QueryWorker, AnotherQuestionWithAnIdThatWaitsIsRefused) {
  WorkerUnderTest worker(limited_to(1e5));
  worker.ask(kLong);
  worker.ask(R"({"id": "a", "stability": {"object": "box"}})");
  worker.ask(R"({"id": "a", "stability": {"object": "box", "max_move": 0.5}})");
  EXPECT_THAT(worker.answers(1).back(), HasSubstr("choose another id"));
  worker.ask(R"({"id": "long", "stability": {"object": "box"}})");
  EXPECT_THAT(worker.answers(2).back(), HasSubstr("choose another id"));
  worker.ask(R"({"stability": {"max_move": 0.01, "object": "box"}, "id": "a"})");  // the same again
  worker.ask(kLong);
  while (worker.counts().repeated < 2) std::this_thread::yield();
  EXPECT_EQ(worker.counts().refused, 2u);
}

TEST(QueryWorker, AnIdThatIsNotUtf8IsRefusedAndTheAnswerIsText) {
  WorkerUnderTest worker({});
  worker.ask("{\"id\": \"\xff\", \"where\": {}}");
  const std::vector<std::string> answers = worker.answers(1);
  EXPECT_THAT(answers[0], HasSubstr("not JSON"));
  EXPECT_TRUE(core::is_utf8(answers[0]));
}

TEST(QueryWorker, BeforeTheFirstFrameTheSceneFileAnswers) {
  WorkerUnderTest worker({});
  worker.ask(R"({"id": "1", "where": {}})");
  const auto answer = parse_or_discard(worker.answers(1).front());
  const auto covariance = answer.at("where").at("items").at(0).at("estimate").at("covariance");
  // The belief's single particle knows no turn; the scene says that any is possible.
  EXPECT_GT(covariance.at(0).at(0).get<double>(), 0.1) << answer.dump();
}

TEST(QueryWorker, AQuestionThatIsAskedAgainWhileItWaitsIsAnsweredOnce) {
  WorkerUnderTest worker(limited_to(1e5));
  worker.ask(kLong);
  for (int i = 0; i < 40; ++i) worker.ask(short_question("a"));
  while (worker.counts().repeated < 39) std::this_thread::yield();
  worker.ask(R"({"cancel": "long"})");
  worker.ask(short_question("last"));
  EXPECT_THAT(tests::by_id(worker.answers(3)), UnorderedElementsAre(Key("long"), Key("a"), Key("last")));
  EXPECT_EQ(worker.counts().repeated, 39u);
  EXPECT_EQ(worker.counts().answered + worker.counts().refused, 3u);
}

TEST(QueryWorker, TurnsAwayWhatWasNoQuestionInAnotherForm) {
  WorkerUnderTest worker({});
  worker.turn_away("7", core::invalid_input("kind: give one, such as 'where'"));
  const auto answer = parse_or_discard(worker.answers(1)[0]);
  EXPECT_EQ(answer["id"], "7");
  EXPECT_EQ(answer["error"], "kind: give one, such as 'where'");
  EXPECT_EQ(answer["code"], "invalid_input");
  EXPECT_EQ(worker.counts().refused, 1U);
}

TEST(QueryWorker, AQuestionThatIsNotUnderstoodIsAnsweredWithTheReason) {
  WorkerUnderTest worker({});
  worker.ask("{");
  worker.ask(R"({"id": "deep", "where": )" + std::string(100000, '[') + std::string(100000, ']') + "}");
  worker.ask(R"({"id": "b", "wher": {}})");
  const std::vector<std::string> answers = worker.answers(3);
  EXPECT_THAT(answers[0], HasSubstr("not JSON"));
  EXPECT_THAT(answers[1], HasSubstr("nested deeper"));
  EXPECT_EQ(id_of(answers[2]), "b");
  EXPECT_THAT(answers[2], HasSubstr("where, predict"));
}

TEST(QueryWorker, PassesOnWhatAsksForAnExplanation) {
  QueryWorkerSettings settings;
  std::atomic<int> asked{0};
  settings.explain = [&](const belief::ExplainQuestion& question,
                         const queries::QueryContext& context) -> core::Result<nlohmann::ordered_json> {
    ++asked;
    EXPECT_TRUE(context.simulate_until);
    EXPECT_EQ(question.last, 1.5);
    if (question.object == "nobody") return core::not_found("there is no object 'nobody'");
    return nlohmann::ordered_json{{"id", question.id}, {"step", 4}, {"explain", {{"text", "nothing"}}}};
  };
  WorkerUnderTest worker(settings);
  worker.ask(R"({"id": "1", "explain": {"last": 1.5}})");
  EXPECT_EQ(worker.answers(1)[0], R"({"id":"1","step":4,"explain":{"text":"nothing"}})");
  worker.ask(R"({"id": "2", "explain": {"last": 1.5, "object": "nobody"}})");
  const auto unknown = parse_or_discard(worker.answers(2)[1]);
  EXPECT_EQ(unknown["id"], "2");
  EXPECT_EQ(unknown["code"], "not_found");
  worker.ask(R"({"id": "3", "explain": {"lst": 1.5}})");
  const std::string misspelt = worker.answers(3)[2];
  EXPECT_THAT(misspelt, HasSubstr("did you mean 'last'?"));
  EXPECT_EQ(id_of(misspelt), "3");
  EXPECT_EQ(asked, 2);
  EXPECT_EQ(worker.counts().answered, 1u);
  EXPECT_EQ(worker.counts().refused, 2u);
  // One that keeps no frames says so, and goes on.
  WorkerUnderTest without({});
  without.ask(R"({"id": "4", "explain": {}})");
  EXPECT_THAT(without.answers(1)[0], HasSubstr("frames are not kept here"));
  without.ask(R"({"id": "5", "where": {}})");
  EXPECT_THAT(without.answers(2)[1], HasSubstr("\"items\""));
}

TEST(QueryWorker, PassesOnWhatAsksWhyAPoseIsBelieved) {
  QueryWorkerSettings settings;
  settings.why = [](const belief::WhyQuestion& question,
                    const queries::QueryContext& context) -> core::Result<nlohmann::ordered_json> {
    EXPECT_TRUE(context.simulate_until);
    if (question.object == "nobody") return core::not_found("there is no object 'nobody'");
    return nlohmann::ordered_json{{"id", question.id}, {"step", 4}, {"why", {{"object", question.object}}}};
  };
  WorkerUnderTest worker(settings);
  worker.ask(R"({"id": "1", "why": {"object": "box"}})");
  EXPECT_EQ(worker.answers(1)[0], R"({"id":"1","step":4,"why":{"object":"box"}})");
  worker.ask(R"({"id": "2", "why": {"object": "nobody"}})");
  EXPECT_EQ(parse_or_discard(worker.answers(2)[1])["code"], "not_found");
  worker.ask(R"({"id": "3", "why": {"object": "box", "agianst": "absence"}})");
  EXPECT_THAT(worker.answers(3)[2], HasSubstr("did you mean 'against'?"));
  EXPECT_EQ(worker.counts().answered, 1u);
  EXPECT_EQ(worker.counts().refused, 2u);
  WorkerUnderTest without({});
  without.ask(R"({"id": "4", "why": {"object": "box"}})");
  EXPECT_THAT(without.answers(1)[0], HasSubstr("frames are not kept here"));
}

}  // namespace
}  // namespace prescene::service
