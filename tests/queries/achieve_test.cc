// SPDX-License-Identifier: Apache-2.0
// How an action has to be done: questions about a carton in a hand, answered with a simulator whose law is known.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "prescene/belief/json.h"
#include "prescene/queries/query_engine.h"
#include "sliding_scene.h"

namespace prescene::queries::achieve_test {

using belief::AchieveAnswer;
using belief::AchieveQuery;
using belief::Answer;
using testing::HasSubstr;

constexpr double kGoodFrom = 0.2, kGoodTo = 0.4;  // m along x

/// The sliding scene with the carton in the hand, and an outcome for it.
std::shared_ptr<belief::Scene> held_scene() {
  auto scene = tests::sliding_scene();
  belief::SceneObject& carton = scene->objects[0];
  carton.held_by = "hand";
  geometry::Matrix6d covariance = geometry::Matrix6d::Zero();
  covariance.diagonal().tail<3>().setConstant(1e-6);
  carton.pose = belief::NormalPose{geometry::Pose::from_translation({0.0, 0.0, 0.5}), covariance};
  scene->robot[0].timeline = {{0.0, geometry::Pose::from_translation({0.0, 0.0, 0.75})}};
  scene->exclusive_outcomes = {
      {"where", {{"fallen", "carton", {belief::Condition{belief::BelowHeight{-0.5}, belief::When::kAtEnd, false}}}}}};
  scene->outcomes = {
      {"on_table", "carton", {belief::Condition{belief::BelowHeight{-0.5}, belief::When::kAtEnd, true}}}};
  return scene;
}

/// What was put down between kGoodFrom and kGoodTo stays, but for one in a hundred; all else falls by a metre.
belief::WorldState fall(const belief::WorldState& start, const simulation::RunRequest&, core::RandomStream stream) {
  belief::WorldState end = start;
  const double x = start.objects[0].X_WO.translation.x();
  if (x < kGoodFrom || x > kGoodTo || stream.uniform() < 0.01) end.objects[0].X_WO.translation.z() -= 1.0;
  return end;
}

AchieveQuery question() {
  AchieveQuery query;
  query.outcome = "on_table";
  query.support = "table";
  query.free = {{"x", -0.9, 0.9}, {"y", -0.9, 0.9}, {"yaw", {}, {}}, {"height", {}, {}}};
  return query;
}

Answer ask(const AchieveQuery& query, int threads = 2, const std::shared_ptr<belief::Scene>& scene = held_scene()) {
  core::ThreadPool pool(threads);
  return queries::answer(scene, 1, {"q", query}, tests::context_with(fall, pool));
}

core::Status error_of(const AchieveQuery& query) { return ask(query).error; }

double value_of(const AchieveAnswer& answer, const std::vector<double>& values, const std::string& name) {
  for (std::size_t i = 0; i < answer.parameters.size(); ++i)
    if (answer.parameters[i].name == name) return values[i];
  ADD_FAILURE() << "no parameter " << name;
  return 0.0;
}

TEST(Achieve, FindsWhereTheObjectStays) {
  const Answer answer = ask(question());
  ASSERT_TRUE(answer.error.ok()) << answer.error.message();
  const auto& told = std::get<AchieveAnswer>(answer.what);
  ASSERT_TRUE(told.found);
  EXPECT_TRUE(told.best.certified);
  EXPECT_GE(told.best.lower, 0.95);
  EXPECT_GT(value_of(told, told.best.values, "x"), kGoodFrom);
  EXPECT_LT(value_of(told, told.best.values, "x"), kGoodTo);
  EXPECT_EQ(told.object, "carton");
  EXPECT_EQ(told.support, "table");
  // The carton is 20 cm high: its origin is half of that above its lowest point.
  ASSERT_TRUE(told.best.X_WO);
  EXPECT_NEAR(told.best.X_WO->translation.z(), 0.1 + value_of(told, told.best.values, "height"), 1e-9);
  ASSERT_TRUE(told.robust);
  EXPECT_GT(value_of(told, told.robust->low, "x"), kGoodFrom - 0.01);
  EXPECT_LT(value_of(told, told.robust->high, "x"), kGoodTo + 0.01);
  EXPECT_GT(value_of(told, told.robust->high, "yaw_deg") - value_of(told, told.robust->low, "yaw_deg"), 270.0);
  EXPECT_GT(told.first_certified_instances, 0);
  EXPECT_NEAR(told.anywhere.probability, 0.99 * (kGoodTo - kGoodFrom) / 1.8, 0.06);
}

TEST(Achieve, TellsWhatDecidesAndWhatHappensInstead) {
  const auto told = std::get<AchieveAnswer>(ask(question()).what);
  for (const belief::SearchedParameter& parameter : told.parameters) {
    ASSERT_EQ(parameter.profile.size(), 16u);
    const bool decides = parameter.name == "x";
    EXPECT_EQ(parameter.fails_alone > 0.5, decides) << parameter.name;
  }
  ASSERT_TRUE(told.map);
  EXPECT_TRUE(told.map->x == "x" || told.map->y == "x");
  EXPECT_EQ(told.map->share.size(), 256u);
  ASSERT_FALSE(told.failures.empty());
  double sum = 0.0;
  bool falls = false;
  for (const belief::FailureReason& reason : told.failures) {
    sum += reason.share;
    falls = falls || (reason.what == "below -0.5 m" && reason.event.starts_with("falls"));
  }
  EXPECT_TRUE(falls);
  EXPECT_NEAR(sum, 1.0 - told.anywhere.probability, 1e-9);
}

TEST(Achieve, PrunesWhereSomethingIsInTheWay) {
  AchieveQuery query = question();
  // All about the cup, which is 5 cm high and stands at (0.3, 0.3).
  query.free = {{"x", 0.29, 0.31}, {"y", 0.0, 0.6}};
  query.fixed = {{"height", 0.0}};
  const auto told = std::get<AchieveAnswer>(ask(query).what);
  EXPECT_TRUE(told.found);
  EXPECT_GT(told.impossible, 0.15);
  EXPECT_LT(told.impossible, 0.35);  // 7 + 5 cm of 60
  bool hits = false;
  for (const belief::FailureReason& reason : told.failures) hits = hits || reason.what == "carton hits cup";
  EXPECT_TRUE(hits);
  EXPECT_GT(std::abs(value_of(told, told.best.values, "y") - 0.3), 0.05);
}

TEST(Achieve, SaysThatNothingWasFoundAndHowGoodTheBestIs) {
  core::ThreadPool pool(2);
  AchieveQuery query = question();
  query.effort.max_instances = 1500;
  const auto half = [](const belief::WorldState& start, const simulation::RunRequest& request,
                       core::RandomStream stream) {
    const bool falls = stream.uniform() < 0.5;
    belief::WorldState end = fall(start, request, stream);
    if (falls) end.objects[0].X_WO.translation.z() -= 2.0;
    return end;
  };
  const Answer answer = queries::answer(held_scene(), 1, {"", query}, tests::context_with(half, pool));
  ASSERT_TRUE(answer.error.ok()) << answer.error.message();
  const auto& told = std::get<AchieveAnswer>(answer.what);
  EXPECT_FALSE(told.found);
  EXPECT_FALSE(told.best.certified);
  EXPECT_EQ(told.best.instances, 128);
  EXPECT_LT(told.best.lower, 0.5);
  EXPECT_GT(told.best.upper, 0.45);
  EXPECT_LT(told.best.upper, 0.75);
  EXPECT_FALSE(told.robust);
  EXPECT_EQ(told.stopped, "max_instances");
  ASSERT_FALSE(told.remarks.empty());
}

TEST(Achieve, GivesTheSameBitsForAnyNumberOfThreads) {
  auto one = std::get<AchieveAnswer>(ask(question(), 1).what), two = std::get<AchieveAnswer>(ask(question(), 2).what);
  for (AchieveAnswer* told : {&one, &two}) told->wall_seconds = told->cpu_seconds = told->first_certified_seconds = 0.0;
  EXPECT_EQ(one, two);
}

TEST(Achieve, AsksForAClassOfAGroupByItsName) {
  AchieveQuery query = question();
  query.outcome = "where.other";
  EXPECT_TRUE(std::get<AchieveAnswer>(ask(query).what).found);
  query.outcome = "fallen";
  const auto told = std::get<AchieveAnswer>(ask(query).what);
  EXPECT_EQ(told.outcome, "where.fallen");
  EXPECT_TRUE(told.found);
}

TEST(Achieve, OpensAHandAtTheRightTime) {
  AchieveQuery query;
  query.outcome = "on_table";
  query.action = "release";
  query.free = {{"time", 0.0, 2.0}};
  query.errors.delay = belief::UniformScalar{0.1, 0.2};
  core::ThreadPool pool(2);
  // It stays where it is let go between 1.0 and 1.5 s.
  const auto law = [](const belief::WorldState& start, const simulation::RunRequest& request, core::RandomStream) {
    belief::WorldState end = start;
    const double time = request.actions.back().time;
    if (time < 1.0 || time > 1.5) end.objects[0].X_WO.translation.z() -= 2.0;
    return end;
  };
  const Answer answer = queries::answer(held_scene(), 1, {"", query}, tests::context_with(law, pool));
  ASSERT_TRUE(answer.error.ok()) << answer.error.message();
  const auto& told = std::get<AchieveAnswer>(answer.what);
  ASSERT_TRUE(told.found);
  EXPECT_GT(told.best.values[0], 0.79);
  EXPECT_LT(told.best.values[0], 1.41);
  ASSERT_TRUE(told.best.action);
  EXPECT_EQ(belief::kind_of(*told.best.action), "release");
}

TEST(Achieve, PushesAnObjectThatIsFree) {
  AchieveQuery query;
  query.wanted = belief::Outcome{"goes", "cup", {belief::Condition{belief::MovedMoreThan{0.05}}}};
  query.action = "push";
  query.object = "cup";
  query.free = {{"direction", {}, {}}, {"distance", 0.02, 0.3}};
  core::ThreadPool pool(2);
  const auto law = [](const belief::WorldState& start, const simulation::RunRequest& request, core::RandomStream) {
    const auto& push = std::get<belief::Push>(request.actions.back().what);
    belief::WorldState end = start;
    end.objects[1].X_WO.translation += 0.5 * (push.to - push.from);
    return end;
  };
  const Answer answer = queries::answer(held_scene(), 1, {"", query}, tests::context_with(law, pool));
  ASSERT_TRUE(answer.error.ok()) << answer.error.message();
  const auto& told = std::get<AchieveAnswer>(answer.what);
  ASSERT_TRUE(told.found);
  EXPECT_GT(value_of(told, told.best.values, "distance"), 0.08);
}

TEST(Achieve, BumpsAnObjectAsHardAsItMust) {
  AchieveQuery query;
  query.wanted = belief::Outcome{"goes", "cup", {belief::Condition{belief::MovedMoreThan{0.05}}}};
  query.action = "bump";
  query.object = "cup";
  query.free = {{"direction", {}, {}}, {"impulse", 0.01, 1.0}, {"height", {}, {}}};
  core::ThreadPool pool(2);
  const auto law = [](const belief::WorldState& start, const simulation::RunRequest& request, core::RandomStream) {
    const auto& bump = std::get<belief::Bump>(request.actions.back().what);
    belief::WorldState end = start;
    end.objects[1].X_WO.translation += 0.1 * belief::mean(bump.impulse);
    return end;
  };
  const Answer answer = queries::answer(held_scene(), 1, {"", query}, tests::context_with(law, pool));
  ASSERT_TRUE(answer.error.ok()) << answer.error.message();
  const auto& told = std::get<AchieveAnswer>(answer.what);
  ASSERT_TRUE(told.found);
  EXPECT_GT(value_of(told, told.best.values, "impulse"), 0.49);
  EXPECT_EQ(belief::kind_of(*told.best.action), "bump");
}

TEST(Achieve, RefusesUnknownNamesWithTheNearest) {
  AchieveQuery query = question();
  query.outcome = "on_tabel";
  EXPECT_THAT(error_of(query).message(), HasSubstr("did you mean 'on_table'"));
  query = question();
  query.action = "palce";
  EXPECT_THAT(error_of(query).message(), HasSubstr("did you mean 'place'"));
  query = question();
  query.free.push_back({"heigth", {}, {}});
  EXPECT_THAT(error_of(query).message(), HasSubstr("did you mean 'height'"));
  query = question();
  query.fixed = {{"rol", 3.0}};
  EXPECT_THAT(error_of(query).message(), HasSubstr("did you mean 'roll_deg'"));
  query = question();
  query.object = "cartn";
  EXPECT_THAT(error_of(query).message(), HasSubstr("did you mean 'carton'"));
  query = question();
  query.support = "shelf";
  EXPECT_THAT(error_of(query).message(), HasSubstr("table"));
}

TEST(Achieve, RefusesWhatMakesNoSense) {
  AchieveQuery query = question();
  query.free[0] = {"x", 0.5, 0.5};
  EXPECT_THAT(error_of(query).message(), HasSubstr("is empty"));
  query.free[0] = {"x", 0.5, 400.0};
  EXPECT_THAT(error_of(query).message(), HasSubstr("out of range"));
  query.free[0] = {"x", 0.5, {}};
  EXPECT_THAT(error_of(query).message(), HasSubstr("give both"));
  query = question();
  query.free.clear();
  EXPECT_THAT(error_of(query).message(), HasSubstr("no parameter is free"));
  query = question();
  query.fixed = {{"x", 0.1}};
  EXPECT_THAT(error_of(query).message(), HasSubstr("both free and fixed"));
  query = question();
  query.free.push_back({"position", {}, {}});
  EXPECT_THAT(error_of(query).message(), HasSubstr("twice"));
  query = question();
  query.object = "cup";
  EXPECT_THAT(error_of(query).message(), HasSubstr("is not held"));
  query = question();
  query.errors.lateral_error = belief::NormalScalar{0.0, 0.1};
  EXPECT_THAT(error_of(query).message(), HasSubstr("of a push"));
  query = question();
  query.errors.delay = belief::NormalScalar{0.1, 0.1};
  EXPECT_THAT(error_of(query).message(), HasSubstr("delay"));
  query.errors.delay = belief::FixedScalar{0.1};
  EXPECT_THAT(error_of(query).message(), HasSubstr("of a release or push"));
  query = question();
  query.probability = 1.0;
  EXPECT_THAT(error_of(query).message(), HasSubstr("probability"));
  query = question();
  query.action = "push";
  query.free = {{"direction", {}, {}}};
  EXPECT_THAT(error_of(query).message(), HasSubstr("can't be pushed"));

  auto scene = held_scene();
  scene->objects[0].held_by.reset();
  EXPECT_THAT(ask(question(), 2, scene).error.message(), HasSubstr("nothing is held"));
}

TEST(Achieve, RefusesOutcomesThatCannotComeAboutOrBeTold) {
  const auto wanting = [](std::vector<belief::Condition> conditions) {
    AchieveQuery query = question();
    query.outcome.clear();
    query.wanted = belief::Outcome{"wanted", "carton", std::move(conditions)};
    return query;
  };
  using belief::Condition;
  using belief::When;
  const std::vector<std::vector<Condition>> contradictions = {
      {Condition{belief::FaceUp{geometry::Vector3d::UnitZ()}}, Condition{belief::FaceUp{geometry::Vector3d::UnitX()}}},
      {Condition{belief::RestingOn{"table"}}, Condition{belief::StillMoving{}}},
      {Condition{belief::UprightWithin{geometry::Vector3d::UnitZ(), 0.2}},
       Condition{belief::UprightWithin{-geometry::Vector3d::UnitZ(), 0.2}}},
      {Condition{belief::MovedMoreThan{0.2}}, Condition{belief::MovedMoreThan{0.1}, When::kEver, true}},
      {Condition{belief::BelowHeight{0.0}}, Condition{belief::InsideVolume{{}, {0.1, 0.1, -0.0 + 1e-3}}, When::kAlways},
       Condition{belief::InsideVolume{geometry::Pose::from_translation({1.0, 0.0, 0.0}), {0.1, 0.1, 0.1}}}},
  };
  for (const auto& conditions : contradictions)
    EXPECT_THAT(error_of(wanting(conditions)).message(), HasSubstr("never hold together"));
  EXPECT_THAT(error_of(wanting({Condition{belief::Touched{"hand"}}})).message(), HasSubstr("can't be decided"));
  EXPECT_TRUE(error_of(wanting({Condition{belief::MovedMoreThan{0.1}, When::kEver},
                                Condition{belief::MovedMoreThan{0.2}, When::kAtEnd, true}}))
                  .ok());
}

TEST(Achieve, IsAskedInJson) {
  const auto query = belief::query_from_json(R"({"id": "a", "achieve": {"outcome": "on_table", "action": "place",
      "object": "carton", "support": "table", "free": {"x": [-0.9, 0.9], "yaw": null}, "fixed": {"height": 0.01},
      "errors": {"position": 0.002, "rotation_deg": [1, 1, 0], "delay": {"normal": [0.1, 0.02], "min": 0}},
      "probability": 0.9, "survey": false, "effort": {"confidence": 0.99}}})");
  ASSERT_TRUE(query.ok()) << query.status().message();
  const auto& achieve = std::get<AchieveQuery>(query->what);
  EXPECT_EQ(achieve.free.size(), 2u);
  EXPECT_EQ(achieve.errors.position, geometry::Vector3d::Constant(0.002));
  EXPECT_EQ(achieve.effort.confidence, 0.99);
  EXPECT_EQ(achieve.effort.max_instances, AchieveQuery{}.effort.max_instances);
  const auto again = belief::query_from_json(belief::json_text(belief::to_json(*query)));
  ASSERT_TRUE(again.ok()) << again.status().message();
  EXPECT_EQ(*again, *query);
  const auto inline_outcome = belief::query_from_json(
      R"({"achieve": {"outcome": {"object": "carton", "upright": {"within_deg": 10}}, "free": ["position"]}})");
  ASSERT_TRUE(inline_outcome.ok()) << inline_outcome.status().message();
  EXPECT_EQ(std::get<AchieveQuery>(inline_outcome->what).wanted->all_of.size(), 1u);
  for (const auto& [text, reason] : std::vector<std::pair<const char*, const char*>>{
           {R"({"achieve": {"outcome": "o", "free": {"x": [2, 1]}}})", "is empty"},
           {R"({"achieve": {"outcome": "o"}})", "'free' is missing"},
           {R"({"achieve": {"outcome": "o", "free": ["x"], "fixxed": {}}})", "did you mean 'fixed'"},
           {R"({"achieve": {"outcome": "o", "free": ["x"], "fixed": [1]}})", "an object"}})
    EXPECT_THAT(belief::query_from_json(text).status().message(), HasSubstr(reason)) << text;
}

TEST(Achieve, ToldWhileItSearchesTheAnswerIsTheSame) {
  AchieveQuery query = question();
  query.effort.exact_instances = 3000;
  const auto without_times = [](AchieveAnswer answer) {
    answer.wall_seconds = answer.cpu_seconds = answer.first_certified_seconds = 0.0;
    return answer;
  };
  const AchieveAnswer plain = without_times(std::get<AchieveAnswer>(ask(query).what));
  std::vector<std::vector<AchieveAnswer>> told;
  for (const int threads : {1, 3}) {
    core::ThreadPool pool(threads);
    QueryContext context = tests::context_with(fall, pool);
    std::vector<AchieveAnswer>& here = told.emplace_back();
    context.on_answer_so_far = [&](const Answer& so_far) {
      EXPECT_EQ(so_far.id, "q");
      EXPECT_EQ(so_far.is_final, false);
      here.push_back(without_times(std::get<AchieveAnswer>(so_far.what)));
    };
    const Answer answer = queries::answer(held_scene(), 1, {"q", query, true}, context);
    EXPECT_EQ(answer.is_final, true);
    EXPECT_EQ(without_times(std::get<AchieveAnswer>(answer.what)), plain) << threads << " threads";
  }
  EXPECT_EQ(told[0], told[1]);
  ASSERT_GE(told[0].size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(told[0][i].instances, 16 << i) << "from few on, and twice as many each time";
    EXPECT_LE(told[0][i].anywhere.low, plain.anywhere.probability);
    EXPECT_GE(told[0][i].anywhere.high, plain.anywhere.probability);
  }
  for (std::size_t i = 1; i < told[0].size(); ++i) {
    const AchieveAnswer &before = told[0][i - 1], &after = told[0][i];
    EXPECT_GE(after.instances, before.instances);
    EXPECT_GE(after.choices.size(), before.choices.size()) << "what is certified stays so";
    for (std::size_t c = 0; c < before.choices.size(); ++c) EXPECT_EQ(after.choices[c], before.choices[c]);
  }
  for (const AchieveAnswer& so_far : told[0]) {
    EXPECT_LE(so_far.candidates.size(), 10u);
    for (std::size_t c = 0; c < so_far.candidates.size(); ++c) {
      EXPECT_TRUE(so_far.candidates[c].X_WO) << "of a place, where the object is let go";
      if (c > 0) {
        EXPECT_LE(so_far.candidates[c].expected, so_far.candidates[c - 1].expected) << "the best first";
      }
    }
    for (const belief::ActionChoice& choice : so_far.choices) EXPECT_GE(choice.lower, query.probability);
  }
  EXPECT_EQ(told[0].back().choices.front(), plain.choices.front());
}

TEST(Achieve, AnswersInJson) {
  core::ThreadPool pool(2);
  const Answer answer = ask(question());
  const nlohmann::ordered_json json = belief::to_json(answer).at("achieve");
  EXPECT_TRUE(json.at("found").get<bool>());
  EXPECT_TRUE(json.at("best").at("values").contains("yaw_deg"));
  EXPECT_TRUE(json.at("best").at("action").contains("place"));
  EXPECT_EQ(json.at("map").at("share").size(), 256u);
  EXPECT_GE(json.at("first_certified").at("instances").get<int>(), 64);
  EXPECT_TRUE(json.contains("remarks"));
}

}  // namespace prescene::queries::achieve_test
