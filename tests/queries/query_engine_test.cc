// SPDX-License-Identifier: Apache-2.0
#include "prescene/queries/query_engine.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <fstream>
#include <iterator>

#include "prescene/belief/json.h"
#include "prescene/belief/why_question.h"
#include "sliding_scene.h"
#include "tests/support/paths.h"

namespace prescene::queries {
namespace {

using belief::Answer;
using belief::PredictAnswer;
using belief::PredictQuery;
using belief::StabilityAnswer;
using belief::WhereAnswer;
using belief::WhereQuery;
using testing::HasSubstr;
using tests::context_with;
using tests::slide;
using tests::sliding_scene;
using tests::two_hypotheses;

const belief::OutcomeProbability& named(const PredictAnswer& answer, const std::string& name) {
  for (const belief::OutcomeProbability& outcome : answer.outcomes)
    if (outcome.name == name) return outcome;
  ADD_FAILURE() << "no outcome " << name;
  return answer.outcomes.front();
}

TEST(Predict, AScenesPriorsGiveTheProbabilityOfTheirOutcomes) {
  core::ThreadPool pool(2);
  const Answer answer = queries::answer(sliding_scene(), 1, {"q1", PredictQuery{}}, context_with(slide, pool));
  ASSERT_TRUE(answer.error.ok()) << answer.error.message();
  EXPECT_EQ(answer.id, "q1");
  const auto& predicted = std::get<PredictAnswer>(answer.what);
  ASSERT_EQ(predicted.outcomes.size(), 3u);
  const belief::OutcomeProbability& slides = named(predicted, "slides");
  EXPECT_EQ(slides.group, "end");
  EXPECT_LE(slides.low, tests::slide_probability());
  EXPECT_GE(slides.high, tests::slide_probability());
  EXPECT_NEAR(slides.probability + named(predicted, "other").probability, 1.0, 1e-12);
  EXPECT_EQ(named(predicted, "cup moves").probability, 0.0);
  EXPECT_EQ(named(predicted, "cup moves").group, "");
  EXPECT_TRUE(predicted.converged);
  EXPECT_GE(predicted.instances, 64);
  EXPECT_NEAR(predicted.simulated_seconds, 2.0 * predicted.instances, 1e-9);
}

TEST(Predict, TellsWhereThingsEndByOutcome) {
  core::ThreadPool pool(2);
  const Answer answer = queries::answer(sliding_scene(), 1, {"", PredictQuery{}}, context_with(slide, pool));
  const auto& predicted = std::get<PredictAnswer>(answer.what);
  ASSERT_EQ(predicted.final_poses.size(), 2u);  // outcomes speak of both
  const belief::FinalPoses& carton = predicted.final_poses[0];
  EXPECT_EQ(carton.object, "carton");
  EXPECT_NEAR(carton.mean_position.x(), named(predicted, "slides").probability, 0.01);
  double sliding = 0.0;
  for (const belief::PoseComponent& component : carton.components) {
    EXPECT_NEAR(component.mean.translation.x(), component.outcome == "slides" ? 1.0 : 0.0, 0.06);
    if (component.outcome == "slides") sliding += component.weight;
  }
  EXPECT_NEAR(sliding, named(predicted, "slides").probability, 1e-9);
}

TEST(Predict, ShowsATypicalRunOfEachOutcomeThatHappened) {
  core::ThreadPool pool(1);
  const Answer answer = queries::answer(sliding_scene(), 1, {"", PredictQuery{}}, context_with(slide, pool));
  const auto& predicted = std::get<PredictAnswer>(answer.what);
  ASSERT_EQ(predicted.typical_runs.size(), 2u);
  EXPECT_EQ(predicted.typical_runs[0].outcome, "other");  // the likelier first
  EXPECT_EQ(predicted.typical_runs[1].outcome, "slides");
  EXPECT_NEAR(predicted.typical_runs[1].share, named(predicted, "slides").probability, 1e-12);
  const belief::Trajectory& run = predicted.typical_runs[1].trajectory;
  EXPECT_GT(run.states.size(), 30u);
  EXPECT_NEAR(run.final().objects[0].X_WO.translation.x(), 1.0, 0.01);  // the middle of those that slid
  EXPECT_FALSE(predicted.typical_runs[1].timeline.empty());
}

TEST(Predict, SameBitsForAnyNumberOfThreads) {
  core::ThreadPool one(1), many(5);
  const Answer a = queries::answer(sliding_scene(), 9, {"", PredictQuery{}}, context_with(slide, one));
  const Answer b = queries::answer(sliding_scene(), 9, {"", PredictQuery{}}, context_with(slide, many));
  const auto& first = std::get<PredictAnswer>(a.what);
  const auto& second = std::get<PredictAnswer>(b.what);
  EXPECT_EQ(first.outcomes, second.outcomes);
  EXPECT_EQ(first.final_poses, second.final_poses);
  EXPECT_EQ(first.instances, second.instances);
  ASSERT_EQ(first.typical_runs.size(), second.typical_runs.size());
  for (std::size_t i = 0; i < first.typical_runs.size(); ++i) {
    EXPECT_EQ(first.typical_runs[i].trajectory, second.typical_runs[i].trajectory);
    EXPECT_EQ(first.typical_runs[i].timeline, second.typical_runs[i].timeline);
  }
}

TEST(Predict, ABeliefsHypothesesKeepTheirMasses) {
  core::ThreadPool pool(1);
  const belief::Belief belief = two_hypotheses();
  const Answer answer = queries::answer(belief, {"", PredictQuery{}}, context_with(slide, pool));
  ASSERT_TRUE(answer.error.ok()) << answer.error.message();
  EXPECT_EQ(answer.step, 17u);
  const auto& predicted = std::get<PredictAnswer>(answer.what);
  EXPECT_NEAR(named(predicted, "slides").probability, 0.25, 1e-12);
  EXPECT_NEAR(predicted.final_poses[0].mean_position.x(), 0.25 * 1.1 + 0.75 * 0.12, 1e-3);
}

TEST(Predict, SimulatesTheBeliefsObjectsAndRobotAtTheSnapshot) {
  core::ThreadPool pool(1);
  std::optional<belief::Scene> simulated;
  QueryContext context = context_with(slide, pool);
  const auto make = context.make_simulator;
  context.make_simulator = [&](const belief::Scene& scene, double step_factor) {
    simulated = scene;
    return make(scene, step_factor);
  };
  belief::Belief belief = two_hypotheses();
  belief.objects[0].particles[0].mode = belief.objects[0].particles[1].mode = belief::MotionMode::kHeld;
  belief.objects[1].state = belief::TrackState::kLost;
  const Answer answer = queries::answer(belief, {"", PredictQuery{}}, context);
  ASSERT_TRUE(answer.error.ok()) << answer.error.message();
  EXPECT_EQ(std::get<PredictAnswer>(answer.what).left_out.size(), 1u);
  ASSERT_EQ(simulated->objects.size(), 1u);  // the cup is lost
  EXPECT_EQ(simulated->objects[0].held_by, "hand");
  EXPECT_EQ(belief::pose_at(simulated->robot[0], 1.0), belief.robot[0]);
  EXPECT_TRUE(simulated->outcomes.empty());  // the one about the cup can't be judged
  EXPECT_EQ(simulated->exclusive_outcomes.size(), 1u);
}

TEST(Predict, AnOutcomeThatNeedsALostObjectIsLeftOutAndTheOthersAreAnswered) {
  core::ThreadPool pool(1);
  belief::Belief belief = two_hypotheses();
  auto scene = std::make_shared<belief::Scene>(*belief.scene);
  scene->outcomes.push_back({"hits the cup", "carton", {belief::Condition{belief::Touched{"cup"}}}});
  scene->exclusive_outcomes.push_back(
      {"how", {{"into the cup", "carton", {belief::Condition{belief::Touched{"cup"}, belief::When::kEver, false}}}}});
  belief.scene = scene;
  belief.objects[1].state = belief::TrackState::kLost;
  const Answer answer = queries::answer(belief, {"", PredictQuery{}}, context_with(slide, pool));
  ASSERT_TRUE(answer.error.ok()) << answer.error.message();
  const auto& predicted = std::get<PredictAnswer>(answer.what);
  EXPECT_THAT(predicted.left_out, ::testing::IsSupersetOf({"hits the cup", "how"}));
  EXPECT_GT(named(predicted, "slides").probability, 0.0);
}

TEST(Predict, AJointWhoseParentIsLostIsLeftOutAndSaidSo) {
  belief::Belief belief = two_hypotheses();
  auto scene = std::make_shared<belief::Scene>(*belief.scene);
  belief::Joint joint;
  joint.name = "lid";
  joint.parent = "cup";
  joint.child = "carton";
  scene->joints = {joint};
  belief.scene = scene;
  const auto remarks_with = [&](belief::TrackState of_cup) {
    belief.objects[1].state = of_cup;
    core::ThreadPool pool(1);
    belief::StabilityQuery of_carton;
    of_carton.object = "carton";
    const Answer answer = queries::answer(belief, {"", of_carton}, context_with(slide, pool));
    EXPECT_TRUE(answer.error.ok()) << answer.error.message();
    std::string all;
    for (const std::string& remark : std::get<StabilityAnswer>(answer.what).remarks) all += remark;
    return all;
  };
  EXPECT_THAT(remarks_with(belief::TrackState::kLost),
              HasSubstr("The joint 'lid' is left out: 'cup' is lost. What is said of 'carton' takes it for free."));
  EXPECT_THAT(remarks_with(belief::TrackState::kTracked), testing::Not(HasSubstr("is left out")));
}

TEST(Predict, AnswersOtherOutcomesThanTheScenes) {
  core::ThreadPool pool(1);
  PredictQuery query;
  query.outcomes.push_back({"far", "carton", {belief::Condition{belief::MovedMoreThan{5.0}}}});
  query.duration = 0.5;
  const Answer answer = queries::answer(two_hypotheses(), {"", query}, context_with(slide, pool));
  const auto& predicted = std::get<PredictAnswer>(answer.what);
  ASSERT_EQ(predicted.outcomes.size(), 1u);
  EXPECT_EQ(predicted.outcomes[0].probability, 0.0);
  EXPECT_NEAR(predicted.simulated_seconds, 0.5 * predicted.instances, 1e-9);
}

TEST(Predict, ATimeLimitedAnswerComesAgainFromItsInstanceCount) {
  core::ThreadPool pool(2);
  PredictQuery query;
  query.effort.tolerance = 1e-3;
  query.effort.max_instances = 1 << 20;
  Answer limited;
  // On a busy machine there may be no instance in a short time.
  for (double seconds = 0.002; !std::holds_alternative<PredictAnswer>(limited.what); seconds *= 10.0) {
    query.effort.max_seconds = seconds;
    limited = queries::answer(sliding_scene(), 4, {"", query}, context_with(slide, pool));
  }
  query.effort.max_seconds.reset();
  query.effort.exact_instances = std::get<PredictAnswer>(limited.what).instances;
  const Answer again = queries::answer(sliding_scene(), 4, {"", query}, context_with(slide, pool));
  EXPECT_EQ(std::get<PredictAnswer>(limited.what).outcomes, std::get<PredictAnswer>(again.what).outcomes);
  EXPECT_EQ(std::get<PredictAnswer>(limited.what).final_poses, std::get<PredictAnswer>(again.what).final_poses);
}

TEST(Predict, WhatIsAbandonedTellsTheProbabilitiesAndWhatIsMissing) {
  core::ThreadPool pool(1);
  core::Cancellation abandoned;
  abandoned.request();
  QueryContext context = context_with(slide, pool);
  context.abandoned = &abandoned;
  PredictQuery query;
  query.detail = {true, true, true, true, true, true, 3};
  const Answer answer = queries::answer(sliding_scene(), 1, {"", query}, context);
  const auto& predicted = std::get<PredictAnswer>(answer.what);
  EXPECT_EQ(predicted.outcomes.size(), 3u);
  EXPECT_TRUE(predicted.final_poses.empty());
  ASSERT_FALSE(predicted.remarks.empty());
  for (const char* part : {"final_poses", "typical_runs", "inputs", "contacts", "paths", "chaos", "model_error"})
    EXPECT_THAT(predicted.remarks.back(), HasSubstr(part));
}

TEST(Predict, BeyondTheMomentToStopSimulatingAllElseIsStillWorkedOut) {
  core::ThreadPool pool(1);
  // The moment comes once the 100th instance has begun, which is still finished.
  std::atomic<int> begun{0};
  const core::Cancellation* never = nullptr;
  core::Cancellation cancellation;
  QueryContext context = context_with(
      [&](const belief::WorldState& start, const simulation::RunRequest& request, core::RandomStream stream) {
        if (++begun == 100) cancellation.request();
        return slide(start, request, stream);
      },
      pool);
  PredictQuery query;
  query.effort.exact_instances = 2000;
  context.cancellation = &cancellation;
  const Answer cut = queries::answer(sliding_scene(), 1, {"", query}, context);
  const auto& predicted = std::get<PredictAnswer>(cut.what);
  EXPECT_EQ(predicted.instances, 100);  // which had begun
  EXPECT_EQ(predicted.stopped, "cancelled");
  EXPECT_EQ(predicted.final_poses.size(), 2u);
  EXPECT_THAT(predicted.remarks.back(), HasSubstr("typical_runs"));

  context.cancellation = never;
  context.simulate_until = core::Cancellation::Clock::now();  // over before it begins
  EXPECT_THAT(core::to_string(queries::answer(sliding_scene(), 1, {"", query}, context).error), HasSubstr("cancelled"));
}

TEST(Predict, MemoryBoundsTheInstances) {
  core::ThreadPool pool(1);
  QueryContext context = context_with(slide, pool);
  context.most_bytes = 1 << 20;
  PredictQuery query;
  query.effort.tolerance = 1e-4;
  const Answer bounded = queries::answer(sliding_scene(), 1, {"", query}, context);
  const auto& predicted = std::get<PredictAnswer>(bounded.what);
  EXPECT_EQ(predicted.stopped, "max_instances");
  EXPECT_GT(predicted.instances, 100);
  EXPECT_LT(predicted.instances, 4096);
  query.effort.exact_instances = predicted.instances;
  const Answer same = queries::answer(sliding_scene(), 1, {"", query}, context);
  EXPECT_EQ(std::get<PredictAnswer>(same.what).outcomes, predicted.outcomes);
  query.effort.exact_instances = 100000;
  EXPECT_THAT(core::to_string(queries::answer(sliding_scene(), 1, {"", query}, context).error),
              HasSubstr("resource exhausted: effort.exact_instances"));
  query.effort.exact_instances = 10;
  query.duration = 3600.0;
  query.outcomes.push_back(
      {"ever", "carton", {belief::Condition{belief::MovedMoreThan{0.5}, belief::When::kEver, false}}});
  EXPECT_THAT(core::to_string(queries::answer(sliding_scene(), 1, {"", query}, context).error),
              HasSubstr("shorter duration"));
}

TEST(Predict, AVeryLargeAnswersDensityIsThatOfItsFirstInstances) {
  core::ThreadPool pool(2);
  const auto carton_of = [&](int instances) {
    PredictQuery query;
    query.effort.exact_instances = instances;
    query.detail = {};
    query.detail.typical_runs = false;
    const Answer answer = queries::answer(two_hypotheses(), {"", query}, context_with(slide, pool));
    return std::get<PredictAnswer>(answer.what).final_poses.at(0);
  };
  const belief::FinalPoses all = carton_of(8192), more = carton_of(12288);
  // The hypotheses keep their weights of 0.25, which slides, and 0.75.
  const auto slid = [](const belief::FinalPoses& poses) {
    double weight = 0.0;
    for (const belief::PoseComponent& component : poses.components)
      if (component.outcome == "slides") weight += component.weight;
    return weight;
  };
  EXPECT_NEAR(slid(all), 0.25, 1e-9);
  EXPECT_NEAR(slid(more), 0.25, 1e-9);
  EXPECT_TRUE(more.mean_position.isApprox(all.mean_position, 1e-4));
  EXPECT_TRUE(more.position_covariance.isApprox(all.position_covariance, 1e-2));
}

TEST(Predict, PathsOfALongDurationStayFewEnoughToBeTold) {
  core::ThreadPool pool(1);
  PredictQuery query;
  query.duration = 3600.0;
  query.effort.exact_instances = 256;
  query.detail = {false, false, false, false, false, false, 1000};
  const Answer answer = queries::answer(sliding_scene(), 1, {"", query}, context_with(slide, pool));
  const auto& predicted = std::get<PredictAnswer>(answer.what);
  std::size_t points = 0;
  for (const belief::ObjectPath& path : predicted.paths) points += path.points.size();
  EXPECT_GT(points, 100000u);
  EXPECT_LE(points, 300000u);
  EXPECT_THAT(predicted.remarks.back(), HasSubstr("paths"));
}

TEST(Predict, WhatCannotBeAnsweredSaysWhy) {
  core::ThreadPool pool(1);
  const QueryContext context = context_with(slide, pool);
  const auto error_of = [&](const PredictQuery& query) {
    const Answer answer = queries::answer(two_hypotheses(), {"x", query}, context);
    EXPECT_TRUE(std::holds_alternative<std::monostate>(answer.what));
    EXPECT_EQ(answer.id, "x");
    return answer.error.message();
  };
  PredictQuery unknown_object;
  belief::Release release;
  release.object = "milk";
  unknown_object.actions.push_back({0.0, release});
  EXPECT_THAT(error_of(unknown_object), HasSubstr("'milk'"));
  PredictQuery unknown_outcome;
  unknown_outcome.outcomes.push_back({"o", "bottle", {tests::moved()}});
  EXPECT_THAT(error_of(unknown_outcome), HasSubstr("'bottle'"));
  PredictQuery effort;
  effort.effort.tolerance = 0.0;
  EXPECT_THAT(error_of(effort), HasSubstr("tolerance"));
  effort.effort.tolerance = std::nan("");
  EXPECT_THAT(error_of(effort), HasSubstr("tolerance"));
  PredictQuery endless;
  endless.duration = 1e9;
  EXPECT_THAT(error_of(endless), HasSubstr("duration"));
  PredictQuery none;
  none.effort.exact_instances = 0;
  EXPECT_THAT(error_of(none), HasSubstr("exact_instances"));

  QueryContext bare;
  bare.pool = &pool;
  EXPECT_THAT(queries::answer(two_hypotheses(), {"", PredictQuery{}}, bare).error.message(), HasSubstr("no simulator"));
  QueryContext broken = context;
  broken.make_simulator = [](const belief::Scene&, double) -> core::Result<std::unique_ptr<simulation::Simulator>> {
    return core::unsupported("carton: a surface can't move");
  };
  EXPECT_THAT(queries::answer(two_hypotheses(), {"", PredictQuery{}}, broken).error.message(),
              HasSubstr("a surface can't move"));
  QueryContext stopped = context;
  core::Cancellation cancellation;
  cancellation.request();
  stopped.cancellation = &cancellation;
  EXPECT_EQ(queries::answer(two_hypotheses(), {"", PredictQuery{}}, stopped).error.code(),
            core::StatusCode::kCancelled);
}

TEST(Where, TellsEachObjectsEstimate) {
  core::ThreadPool pool(1);
  const QueryContext context = context_with(slide, pool);
  const Answer answer = queries::answer(two_hypotheses(), {"", WhereQuery{}}, context);
  const auto& found = std::get<WhereAnswer>(answer.what);
  ASSERT_EQ(found.items.size(), 2u);
  EXPECT_EQ(found.items[0].object, "carton");
  EXPECT_EQ(found.items[0].model, "carton");
  EXPECT_NEAR(found.items[0].estimate.mean.translation.x(), 0.25 * 0.1 + 0.75 * 0.12, 1e-12);
  EXPECT_TRUE(found.items[0].alternatives.empty()) << "2 cm apart is one place";
  const Answer one = queries::answer(two_hypotheses(), {"", WhereQuery{"cup"}}, context);
  EXPECT_EQ(std::get<WhereAnswer>(one.what).items.size(), 1u);
  const Answer none = queries::answer(two_hypotheses(), {"", WhereQuery{"mug"}}, context);
  EXPECT_THAT(none.error.message(), HasSubstr("carton, cup"));
}

TEST(Where, OfASceneIsItsPriors) {
  core::ThreadPool pool(1);
  const Answer answer = queries::answer(sliding_scene(), 1, {"", WhereQuery{"carton"}}, context_with(slide, pool));
  const auto& found = std::get<WhereAnswer>(answer.what);
  ASSERT_EQ(found.items.size(), 1u);
  EXPECT_NEAR(found.items[0].estimate.covariance(4, 4), 4e-4, 1e-12);
  EXPECT_EQ(found.items[0].state, belief::TrackState::kUnseen);
}

TEST(Documentation, ItsQuestionsAreUnderstood) {
  std::ifstream page(tests::source_dir() / "docs" / "reference" / "queries.md");
  ASSERT_TRUE(page) << "docs/reference/queries.md is missing";
  const std::string text{std::istreambuf_iterator<char>(page), {}};
  // Blocks marked `json` that begin with an id and a task are questions, but for those with a step: answers.
  int questions = 0;
  static const std::string kBegin = "```json\n", kEnd = "```";
  for (std::size_t at = text.find(kBegin); at != std::string::npos; at = text.find(kBegin, at)) {
    at += kBegin.size();
    const std::string block = text.substr(at, text.find(kEnd, at) - at);
    if (block.find("\"step\"") != std::string::npos) continue;
    ++questions;
    if (belief::asks_why(block)) {
      const auto why = belief::why_question_from_json(block);
      EXPECT_TRUE(why) << block << core::to_string(why.status());
      continue;
    }
    const auto query = belief::query_from_json(block);
    EXPECT_TRUE(query) << block << core::to_string(query.status());
  }
  EXPECT_GE(questions, 4);
}

}  // namespace
}  // namespace prescene::queries
