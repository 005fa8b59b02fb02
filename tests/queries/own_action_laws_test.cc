// SPDX-License-Identifier: Apache-2.0
// Actions that stand in for the scene's own: what is found for them is what a prediction says of a scene in which the
// same numbers were written by hand.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "own_action_cases.h"
#include "prescene/belief/action_schema.h"
#include "prescene/geometry/angles.h"
#include "prescene/queries/query_engine.h"
#include "sliding_scene.h"

namespace prescene::queries::own_action_laws_test {
namespace {

using belief::AchieveAnswer;
using belief::AchieveQuery;
using belief::Answer;
using geometry::Pose;
using geometry::Vector3d;
using testing::HasSubstr;

AchieveAnswer achieved(const Case& one, int threads) {
  Answer answer = ask(one, question(one), threads);
  EXPECT_TRUE(answer.error.ok()) << one.kind << ": " << answer.error.message();
  AchieveAnswer told = answer.error.ok() ? std::get<AchieveAnswer>(answer.what) : AchieveAnswer{};
  told.wall_seconds = told.cpu_seconds = told.first_certified_seconds = 0.0;
  return told;
}

TEST(OwnActions, TheBestChoiceIsAsGoodAsItIsPredictedWhereItIsWrittenInTheScene) {
  for (const Case& one : cases()) {
    SCOPED_TRACE(one.kind);
    const AchieveAnswer told = achieved(one, 2);
    ASSERT_TRUE(told.found);
    EXPECT_GE(told.best.lower, 0.95);
    Values values;
    for (std::size_t i = 0; i < told.parameters.size(); ++i) values[told.parameters[i].name] = told.best.values[i];
    auto scene = scene_of(one);
    one.write(values, *scene);
    belief::PredictQuery predict;
    predict.detail = {false, false};
    predict.effort.exact_instances = 4096;
    core::ThreadPool pool(2);
    const Answer answer = queries::answer(scene, 7, {"p", predict}, tests::context_with(law_of(one), pool));
    ASSERT_TRUE(answer.error.ok()) << answer.error.message();
    const double predicted = std::get<belief::PredictAnswer>(answer.what).outcomes.at(0).probability;
    // The choice's instances are independent draws; the prediction's scatter less. Once in 10,000 runs of other seeds.
    const double sigma =
        std::sqrt(std::max(predicted * (1.0 - predicted), 0.01) * (1.0 / told.best.instances + 1.0 / 4096.0));
    EXPECT_NEAR(told.best.probability, predicted, 3.9 * sigma);
    ASSERT_TRUE(told.best.action);
    EXPECT_EQ(belief::kind_of(*told.best.action), one.kind);
  }
}

Pose at_height(double x, double z) { return Pose::from_translation({x, 0.0, z}); }

// It was grasped after the start, and the hand has moved since then.
TEST(OwnActions, ASpeedIsAlongTheWayFromWhereTheHandHasBroughtWhatItGrasped) {
  Case one = cases().back();
  ASSERT_EQ(one.kind, "transport");
  one.carried = false;
  one.own = {1.0, carry_to({0.7, 0.4, 0.5}, 1.0)};  // half a metre from (0.4, 0, 0.5)
  one.miss = [](const std::vector<Action>&, const belief::WorldState&) { return 0.0; };
  auto scene = scene_of(one);
  scene->objects[0].held_by.reset();
  scene->robot[0].timeline = {{0.0, at_height(-0.1, 0.75)}, {0.2, at_height(0.0, 0.75)}, {0.8, at_height(0.4, 0.75)}};
  scene->actions.insert(scene->actions.begin(), {0.2, belief::Grasp{"carton", "hand", {}}});
  AchieveQuery query = question(one);
  query.free = {{"time", 1.0, 1.2}};
  query.fixed = {{"speed", 0.8}};
  core::ThreadPool pool(2);
  const Answer answer = queries::answer(scene, 1, {"q", query}, tests::context_with(law_of(one), pool));
  ASSERT_TRUE(answer.error.ok()) << answer.error.message();
  const auto& told = std::get<AchieveAnswer>(answer.what);
  ASSERT_TRUE(told.best.action);
  EXPECT_NEAR(std::get<belief::Transport>(told.best.action->what).duration, 0.5 / 0.8, 1e-9);
}

// Another hand takes over what was carried, and lifts it by 0.2 m.
TEST(OwnActions, ACarryLeadsToTheHeightThatIsChosenWhateverHandsDoAfterIt) {
  const std::vector<Case> all = cases();
  Case one = *std::find_if(all.begin(), all.end(), [](const Case& c) { return c.kind == "pour"; });
  one.own.time = 2.0;
  one.miss = [](const std::vector<Action>& actions, const belief::WorldState&) {
    return std::abs(height_of(own_of<belief::Transport>(actions).X_WO) - 0.65) < 1e-9 ? 0.0 : 10.0;
  };
  auto scene = scene_of(one);
  belief::KinematicBody other = scene->robot[0];
  other.name = "other";
  other.timeline = {{1.2, at_height(0.3, 0.6)}, {1.8, at_height(0.3, 0.8)}};
  scene->robot.push_back(other);
  scene->duration = 4.0;
  scene->actions.insert(scene->actions.begin() + 1, {1.0, belief::Grasp{"carton", "other", {}}});
  AchieveQuery query = question(one);
  query.free = {{"angle", 0.0, 150.0}};
  query.fixed = {{"height", 0.85}};
  core::ThreadPool pool(2);
  const Answer answer = queries::answer(scene, 1, {"q", query}, tests::context_with(law_of(one), pool));
  ASSERT_TRUE(answer.error.ok()) << answer.error.message();
  EXPECT_TRUE(std::get<AchieveAnswer>(answer.what).found);
  EXPECT_GE(std::get<AchieveAnswer>(answer.what).best.lower, 0.95);
}

TEST(OwnActions, GiveTheSameBitsForAnyNumberOfThreads) {
  for (const Case& one : cases()) EXPECT_EQ(achieved(one, 1), achieved(one, 2)) << one.kind;
}

TEST(OwnActions, WhatIsNotChosenStaysAsTheSceneHasIt) {
  for (const Case& one : cases()) {
    if (one.kind != "insert") continue;
    AchieveQuery query = question(one);
    query.free = {{"force", 5.0, 40.0}};
    const Answer answer = ask(one, query);
    ASSERT_TRUE(answer.error.ok()) << answer.error.message();
    const auto& told = std::get<AchieveAnswer>(answer.what);
    ASSERT_TRUE(told.best.action);
    auto expected = std::get<belief::Insert>(one.own.what);
    std::get<belief::NormalScalar>(expected.force).mean = told.best.values[0];
    EXPECT_EQ(*told.best.action, (Action{one.own.time, expected})) << "it scatters as in the scene";
  }
}

TEST(OwnActions, WithoutOneInTheSceneItIsAdded) {
  Case one = cases().front();
  auto scene = scene_of(one);
  scene->actions.clear();
  core::ThreadPool pool(2);
  const Answer answer = queries::answer(scene, 1, {"q", question(one)}, tests::context_with(law_of(one), pool));
  ASSERT_TRUE(answer.error.ok()) << answer.error.message();
  EXPECT_TRUE(std::get<AchieveAnswer>(answer.what).found);
  EXPECT_EQ(std::get<AchieveAnswer>(answer.what).object, "carton") << "the one that is held";
}

TEST(OwnActions, BoundsAreThoseOfTheSchema) {
  for (const Case& one : cases()) {
    const belief::ActionSchema& schema = **belief::find_action_schema(one.kind);
    for (const belief::ActionParameter& parameter : schema.parameters) {
      if (parameter.name == "to_deg") continue;  // of a hinge
      if (parameter.name == "height" && !one.carried) continue;
      for (const double beyond : {parameter.least - 1.0, parameter.most + 1.0}) {
        AchieveQuery query = question(one);
        query.free = {{parameter.name, std::min(beyond, parameter.least), std::max(beyond, parameter.most)}};
        EXPECT_THAT(ask(one, query).error.message(), HasSubstr("out of range")) << one.kind << " " << parameter.name;
        query = question(one);
        std::erase_if(query.free, [&](const belief::ParameterRange& range) {
          return range.name == "position" || parameter.name.starts_with(range.name);
        });
        if (query.free.empty()) query.free = {{"time", {}, {}}};
        if (parameter.name == "time") query.free = {{schema.parameters.front().name, {}, {}}};
        query.fixed = {{parameter.name, beyond}};
        EXPECT_THAT(ask(one, query).error.message(), HasSubstr("out of range")) << one.kind << " " << parameter.name;
      }
    }
  }
}

TEST(OwnActions, WhatCannotBeSearchedIsRefusedWithTheReason) {
  for (const Case& one : cases()) {
    const belief::ActionSchema& schema = **belief::find_action_schema(one.kind);
    for (const belief::NotSearched& other : schema.not_searched) {
      AchieveQuery query = question(one);
      query.free = {{other.name, 0.0, 1.0}};
      EXPECT_THAT(ask(one, query).error.message(), HasSubstr(other.reason)) << one.kind << " " << other.name;
    }
    AchieveQuery query = question(one);
    query.errors.position = Vector3d::Constant(0.01);
    EXPECT_THAT(ask(one, query).error.message(), HasSubstr("errors.position: that is of a place")) << one.kind;
  }
}

TEST(OwnActions, WhatTheSceneLacksIsRefusedWithTheRemedy) {
  std::vector<Case> all = cases();
  const auto without_carry = [](Case one) {
    one.carried = false;
    return one;
  };
  for (const Case& one : all) {
    AchieveQuery query = question(one);
    if (one.kind == "pour") {
      EXPECT_THAT(ask(without_carry(one), query).error.message(), HasSubstr("give the scene a transport"));
    }
    if (one.kind == "move_joint") {
      query.free = {{"to_deg", 0.0, 10.0}};
      EXPECT_THAT(ask(one, query).error.message(), HasSubstr("is a slider: its position is 'to', in metres"));
      query.free = {{"to", 0.0, 0.1}};
      query.fixed = {{"to_deg", 5.0}};
      EXPECT_THAT(ask(one, query).error.message(), HasSubstr("is a slider: its position is 'to', in metres"));
      auto hinged = scene_of(one);
      hinged->joints[0].type = belief::JointType::kHinge;
      std::get<belief::MoveJoint>(hinged->actions.back().what).type = belief::JointType::kHinge;
      const auto ask_hinged = [&] {
        core::ThreadPool pool(1);
        return queries::answer(hinged, 1, {"q", query}, tests::context_with(law_of(one), pool)).error.message();
      };
      query.fixed.clear();
      EXPECT_THAT(ask_hinged(), HasSubstr("is a hinge: its position is 'to_deg', in degrees"));
      query.free = {{"force", 10.0, 20.0}};
      query.fixed = {{"to", 0.1}};
      EXPECT_THAT(ask_hinged(), HasSubstr("is a hinge: its position is 'to_deg', in degrees"));
      query = question(one);
      query.object = "carton";
      EXPECT_THAT(ask(one, query).error.message(), HasSubstr("'carton' hangs on no joint"));
    }
    if (one.kind == "pull" || one.kind == "grasp") {
      query.object = "carton";
      EXPECT_THAT(ask(one, query).error.message(), HasSubstr("name an object that is free"));
    }
    if (one.kind == "tilt") {
      query.object = "cup";
      EXPECT_THAT(ask(one, query).error.message(),
                  HasSubstr("'cup' is not held by a robot body, so it can't be tilted"));
    }
    if (one.kind == "transport") {
      auto scene = scene_of(one);
      scene->actions.clear();
      core::ThreadPool pool(1);
      EXPECT_THAT(queries::answer(scene, 1, {"q", query}, tests::context_with(law_of(one), pool)).error.message(),
                  HasSubstr("nowhere, so that there is no speed to choose"));
    }
  }
}

TEST(OwnActions, AForceIsNeverChosenWhereTheSceneCutsIt) {
  for (Case one : cases()) {
    if (one.kind != "pull") continue;
    std::get<belief::Pull>(one.own.what).force = belief::NormalScalar{10.0, 2.0, 8.0, 15.0};
    AchieveQuery query = question(one);
    query.free = {{"force", {}, {}}};
    const Answer answer = ask(one, query);
    ASSERT_TRUE(answer.error.ok()) << answer.error.message();
    const auto& told = std::get<AchieveAnswer>(answer.what);
    EXPECT_EQ(told.parameters[0].low, 8.0);
    EXPECT_EQ(told.parameters[0].high, 15.0);
    EXPECT_THAT(told.remarks, testing::IsSupersetOf({HasSubstr("'force' is searched no lower than 8: "),
                                                     HasSubstr("'force' is searched no higher than 15: ")}));
    ASSERT_TRUE(told.best.action);
    const auto& force = std::get<belief::NormalScalar>(std::get<belief::Pull>(told.best.action->what).force);
    EXPECT_EQ(force, (belief::NormalScalar{told.best.values[0], 2.0, 8.0, 15.0}));
    query.free = {{"force", 9.0, 15.0}};
    EXPECT_TRUE(ask(one, query).error.ok());
    query.free = {{"force", 9.0, 16.0}};
    EXPECT_THAT(ask(one, query).error.message(), HasSubstr("free.force: 16 is out of range: "));
    query.free = {{"force", 7.0, 12.0}};
    EXPECT_THAT(ask(one, query).error.message(), HasSubstr("give at least 8"));
    query.free = {{"direction", -90.0, 90.0}};
    query.fixed = {{"force", 40.0}};
    EXPECT_THAT(ask(one, query).error.message(), HasSubstr("fixed.force: 40 is out of range: "));
  }
}

TEST(OwnActions, TheTimeKeepsTheOrderOfWhatTheSceneDoes) {
  for (const Case& one : cases()) {
    if (one.kind != "tilt") continue;
    // It is carried from 0.3 to 0.8 s, and let go at 1.5 s.
    const auto asked = [&](const AchieveQuery& query, bool in_scene) {
      auto scene = scene_of(one);
      scene->actions = {{0.3, carry_to({0.0, 0.0, 0.6})}};
      if (in_scene) scene->actions.push_back({1.0, one.own.what});
      scene->actions.push_back({1.5, belief::Release{"carton"}});
      core::ThreadPool pool(2);
      return queries::answer(scene, 1, {"q", query}, tests::context_with(law_of(one), pool));
    };
    AchieveQuery query = question(one);
    query.free = {{"time", {}, {}}};
    const auto range = [&](bool in_scene) {
      const Answer answer = asked(query, in_scene);
      EXPECT_TRUE(answer.error.ok()) << answer.error.message();
      if (!answer.error.ok()) return std::pair(0.0, 0.0);
      const belief::SearchedParameter& time = std::get<AchieveAnswer>(answer.what).parameters.at(0);
      return std::pair(time.low, time.high);
    };
    EXPECT_EQ(range(true), std::pair(0.8, 1.5));
    EXPECT_EQ(range(false), std::pair(0.0, 1.0)) << "one that is added may come before";
    const auto error = [&](double low, double high, bool in_scene) {
      query.free = {{"time", low, high}};
      return asked(query, in_scene).error.message();
    };
    EXPECT_THAT(error(0.0, 1.2, true), HasSubstr("free.time: 0 is out of range: the scene's transport of 'carton'"));
    EXPECT_THAT(error(0.9, 1.6, true), HasSubstr("free.time: 1.6 is out of range: the scene's release of 'carton'"));
    EXPECT_EQ(error(0.8, 1.5, true), "");
    EXPECT_THAT(error(0.0, 1.6, false), HasSubstr("release of 'carton' comes after: give 1.5 s or earlier"));
    query.free = {{"angle", 0.0, 90.0}};
    query.fixed = {{"time", 0.5}};
    EXPECT_THAT(asked(query, true).error.message(), HasSubstr("fixed.time: 0.5 is out of range: "));
  }
}

TEST(OwnActions, WhatIsTooSlowForTheNextActionIsNoChoice) {
  Case one = cases().back();
  ASSERT_EQ(one.kind, "transport");
  auto scene = scene_of(one);
  scene->actions.push_back({1.75, belief::Release{"carton"}});
  AchieveQuery query = question(one);
  query.free = {{"speed", 0.2, 2.2}};
  core::ThreadPool pool(2);
  const Answer answer = queries::answer(scene, 1, {"q", query}, tests::context_with(law_of(one), pool));
  ASSERT_TRUE(answer.error.ok()) << answer.error.message();
  const auto& told = std::get<AchieveAnswer>(answer.what);
  // Half a metre in 0.75 s.
  EXPECT_NEAR(told.impossible, (0.5 / 0.75 - 0.2) / 2.0, 0.05);
  EXPECT_TRUE(std::ranges::any_of(
      told.failures, [](const auto& reason) { return reason.what.find("still on its way") != std::string::npos; }));
}

}  // namespace
}  // namespace prescene::queries::own_action_laws_test
