// SPDX-License-Identifier: Apache-2.0
// What is told of an answer while the work on it goes on.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <vector>

#include "prescene/belief/json.h"
#include "prescene/queries/query_engine.h"
#include "sliding_scene.h"

namespace prescene::queries::so_far_laws_test {
namespace {

using belief::Answer;
using belief::PredictAnswer;
using belief::PredictQuery;
using belief::Query;
using belief::StabilityAnswer;
using belief::StabilityQuery;

Answer without_times(Answer answer) {
  std::visit(
      [](auto& what) {
        if constexpr (requires { what.wall_seconds; }) what.wall_seconds = what.cpu_seconds = 0.0;
      },
      answer.what);
  return answer;
}

struct Told {
  std::vector<Answer> so_far;
  Answer answer;
};

/// Of the belief, or else of the scene.
Told ask(const Query& query, int threads, bool of_belief) {
  core::ThreadPool pool(threads);
  Told told;
  QueryContext context = tests::context_with(tests::slide, pool);
  context.on_answer_so_far = [&](const Answer& so_far) { told.so_far.push_back(without_times(so_far)); };
  told.answer = without_times(of_belief ? queries::answer(tests::two_hypotheses(), query, context)
                                        : queries::answer(tests::sliding_scene(), 1, query, context));
  return told;
}

std::vector<Query> questions() {
  PredictQuery predict;
  predict.effort.exact_instances = 700;
  PredictQuery converging;
  converging.detail = {false, false};
  StabilityQuery stability;
  stability.object = "carton";
  stability.effort.tolerance = 0.01;
  return {{"p", predict}, {"c", converging}, {"s", stability}};
}

int instances_of(const Answer& answer) {
  if (const auto* predict = std::get_if<PredictAnswer>(&answer.what)) return predict->instances;
  return std::get<StabilityAnswer>(answer.what).instances;
}

TEST(SoFar, TheAnswerIsThatOfAQuestionThatIsNotStreamed) {
  for (const bool of_belief : {false, true}) {
    for (const Query& query : questions()) {
      const Told plain = ask(query, 2, of_belief);
      EXPECT_TRUE(plain.so_far.empty()) << "nothing is told to whoever did not ask for it";
      EXPECT_FALSE(plain.answer.is_final);
      Query streamed = query;
      streamed.stream = true;
      const Told one = ask(streamed, 1, of_belief), three = ask(streamed, 3, of_belief);
      EXPECT_EQ(one.so_far, three.so_far) << "what is told does not depend on threads";
      EXPECT_EQ(one.answer, three.answer);
      EXPECT_EQ(one.answer.is_final, true);
      Answer answer = one.answer;
      answer.is_final.reset();
      EXPECT_EQ(answer, plain.answer) << query.id;
    }
  }
}

TEST(SoFar, IsToldFromTheFirstInstancesOnUnderTheAnswersId) {
  for (Query query : questions()) {
    query.stream = true;
    const Told told = ask(query, 2, false);
    ASSERT_GE(told.so_far.size(), 3u) << query.id;
    EXPECT_EQ(instances_of(told.so_far[0]), 16);
    EXPECT_EQ(instances_of(told.so_far[1]), 32);
    EXPECT_EQ(instances_of(told.so_far.back()), instances_of(told.answer));
    for (std::size_t i = 0; i < told.so_far.size(); ++i) {
      EXPECT_EQ(told.so_far[i].id, query.id);
      EXPECT_EQ(told.so_far[i].step, told.answer.step);
      EXPECT_EQ(told.so_far[i].is_final, false);
      EXPECT_EQ(told.so_far[i].what.index(), told.answer.what.index());
      if (i > 0) {
        EXPECT_GT(instances_of(told.so_far[i]), instances_of(told.so_far[i - 1]));
      }
    }
  }
}

// Looked at again and again, an interval must be wider than one that is looked at once.
TEST(SoFar, IntervalsAreWiderThanTheAnswersOfAsManyInstances) {
  Query query = questions().front();
  query.stream = true;
  const Told told = ask(query, 2, false);
  const auto& predict = std::get<PredictAnswer>(told.answer.what);
  int compared = 0;
  for (const Answer& so_far : told.so_far) {
    const auto& known = std::get<PredictAnswer>(so_far.what);
    for (const belief::ProbabilityStage& stage : predict.history) {
      if (stage.instances != known.instances) continue;
      ++compared;
      ASSERT_EQ(stage.outcomes.size(), known.outcomes.size());
      for (std::size_t i = 0; i < stage.outcomes.size(); ++i) {
        EXPECT_EQ(known.outcomes[i].probability, stage.outcomes[i].probability);
        EXPECT_LE(known.outcomes[i].low, stage.outcomes[i].low);
        EXPECT_GE(known.outcomes[i].high, stage.outcomes[i].high);
      }
    }
  }
  EXPECT_EQ(compared, static_cast<int>(predict.history.size()));
}

TEST(SoFar, OfAQuestionWithNothingToTellTheAnswerIsAllThereIs) {
  const Told where = ask({"w", belief::WhereQuery{}, true}, 1, true);
  EXPECT_TRUE(where.so_far.empty());
  EXPECT_EQ(where.answer.is_final, true);
  StabilityQuery absent;
  absent.object = "mug";
  const Told error = ask({"e", absent, true}, 1, false);
  EXPECT_TRUE(error.so_far.empty());
  EXPECT_EQ(belief::to_json(error.answer).at("final"), true);
  EXPECT_TRUE(belief::to_json(error.answer).contains("error"));
}

TEST(SoFar, TheQuestionIsReadAsItIsWritten) {
  const auto query = belief::query_from_json(R"({"id": "1", "stream": true, "stability": {"object": "box"}})");
  ASSERT_TRUE(query.ok()) << query.status().message();
  EXPECT_TRUE(query->stream);
  EXPECT_EQ(*belief::query_from_json(belief::json_text(belief::to_json(*query))), *query);
  EXPECT_FALSE(belief::query_from_json(R"({"stream": 1, "where": {}})").ok());
}

}  // namespace
}  // namespace prescene::queries::so_far_laws_test
