// SPDX-License-Identifier: Apache-2.0
// Actions that stand in for the scene's own: what is found for them is what a prediction says of a scene in which the
// same numbers were written by hand.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "prescene/belief/action_schema.h"
#include "prescene/geometry/angles.h"
#include "prescene/queries/query_engine.h"
#include "sliding_scene.h"

namespace prescene::queries::own_action_laws_test {
namespace {

using belief::AchieveAnswer;
using belief::AchieveQuery;
using belief::Action;
using belief::Answer;
using geometry::Pose;
using geometry::Vector3d;
using testing::HasSubstr;

using Values = std::map<std::string, double>;

/// A kind of action in the sliding scene, how its numbers are written there by hand, and how far an instance's are from
/// those that would be best.
struct Case {
  std::string kind;
  Action own;
  std::vector<belief::ParameterRange> free;
  std::function<void(const Values&, belief::Scene&)> write;
  std::function<double(const std::vector<Action>&, const belief::WorldState&)> miss;
  bool carried = false;  // by a transport of the scene's before
};

template <class What>
const What& own_of(const std::vector<Action>& actions) {
  const What* found = nullptr;
  for (const Action& action : actions)
    if (const auto* one = std::get_if<What>(&action.what)) found = one;
  if (found == nullptr) throw std::logic_error("the action is not there");
  return *found;
}
template <class What>
What& own_of(std::vector<Action>& actions) {
  return const_cast<What&>(own_of<What>(std::as_const(actions)));
}

double off(double value, double best, double scale) { return std::abs(value - best) / scale; }
double degrees(double radians) { return radians / geometry::kDegree; }
Vector3d level(double direction_deg) {
  return {std::cos(geometry::kDegree * direction_deg), std::sin(geometry::kDegree * direction_deg), 0.0};
}

belief::Transport carry_to(const Vector3d& p, double duration = 0.5) {
  geometry::Matrix6d covariance = geometry::Matrix6d::Zero();
  covariance.diagonal().tail<3>().setConstant(1e-8);
  return {"carton", belief::NormalPose{Pose::from_translation(p), covariance}, duration};
}
double height_of(const belief::PoseDistribution& pose) { return belief::mean(pose).translation.z(); }

std::vector<Case> cases() {
  std::vector<Case> all;
  all.push_back({"tilt",
                 {0.2, belief::Tilt{"carton", Vector3d::UnitY(), 0.5, {0.0, 0.0, -0.1}, 1.0}},
                 {{"angle", 0.0, 90.0}, {"axis", {}, {}}},
                 [](const Values& values, belief::Scene& scene) {
                   auto& tilt = own_of<belief::Tilt>(scene.actions);
                   tilt.angle = geometry::kDegree * values.at("angle_deg");
                   tilt.axis_W = level(values.at("axis_deg"));
                 },
                 [](const std::vector<Action>& actions, const belief::WorldState&) {
                   const auto& tilt = own_of<belief::Tilt>(actions);
                   return off(degrees(tilt.angle), 60.0, 100.0) + (tilt.axis_W - level(120.0)).norm() / 5.0;
                 }});
  all.push_back({"pour",
                 {1.0, belief::Pour{"carton", Vector3d::UnitX(), 1.0, 0.5}},
                 {{"angle", 0.0, 150.0}, {"height", {}, {}}},
                 [](const Values& values, belief::Scene& scene) {
                   own_of<belief::Pour>(scene.actions).angle = geometry::kDegree * values.at("angle_deg");
                   auto& pose = std::get<belief::NormalPose>(own_of<belief::Transport>(scene.actions).X_WO);
                   pose.mean.translation.z() = values.at("height");
                 },
                 [](const std::vector<Action>& actions, const belief::WorldState&) {
                   return off(degrees(own_of<belief::Pour>(actions).angle), 100.0, 200.0) +
                          off(height_of(own_of<belief::Transport>(actions).X_WO), 0.55, 0.5);
                 },
                 true});
  const auto write_insert = [](const Values& values, belief::Scene& scene, Pose& X_WO) {
    X_WO.translation.x() = values.at("x");
    X_WO.translation.y() = values.at("y");
    X_WO.rotation = geometry::exp_rotation(geometry::kDegree * values.at("yaw_deg") * Vector3d::UnitZ());
    std::get<belief::NormalScalar>(own_of<belief::Insert>(scene.actions).force).mean = values.at("force");
  };
  const auto miss_of_insert = [](const std::vector<Action>& actions, const Pose& X_WO) {
    const double yaw = degrees(geometry::log_rotation(X_WO.rotation).z());
    return off(X_WO.translation.x(), 0.01, 0.2) + off(X_WO.translation.y(), -0.01, 0.2) + off(yaw, 4.0, 200.0) +
           off(belief::mean(own_of<belief::Insert>(actions).force), 20.0, 200.0);
  };
  const belief::Insert insert{"carton", -Vector3d::UnitZ(), 0.1, 1.0, belief::NormalScalar{12.0, 2.0, 1.0}};
  all.push_back({"insert",
                 {0.5, insert},
                 {{"position", {}, {}}, {"yaw", {}, {}}, {"force", 5.0, 40.0}},
                 [write_insert](const Values& values, belief::Scene& scene) {
                   write_insert(values, scene, std::get<belief::NormalPose>(scene.objects[0].pose).mean);
                 },
                 [miss_of_insert](const std::vector<Action>& actions, const belief::WorldState& start) {
                   return miss_of_insert(actions, start.objects[0].X_WO);
                 }});
  all.push_back({"insert",
                 {1.0, insert},
                 {{"x", -0.02, 0.02}, {"y", {}, {}}, {"yaw", {}, {}}, {"force", {}, {}}},
                 [write_insert](const Values& values, belief::Scene& scene) {
                   auto& pose = std::get<belief::NormalPose>(own_of<belief::Transport>(scene.actions).X_WO);
                   write_insert(values, scene, pose.mean);
                 },
                 [miss_of_insert](const std::vector<Action>& actions, const belief::WorldState&) {
                   return miss_of_insert(actions, belief::mean(own_of<belief::Transport>(actions).X_WO));
                 },
                 true});
  all.push_back({"grasp",
                 {0.1, belief::Grasp{"cup", "hand", belief::Grip{belief::NormalScalar{8.0, 1.0, 0.0}}}},
                 {{"grip_force", {}, {}}},
                 [](const Values& values, belief::Scene& scene) {
                   auto& grip = *own_of<belief::Grasp>(scene.actions).grip;
                   std::get<belief::NormalScalar>(grip.force).mean = values.at("grip_force");
                 },
                 [](const std::vector<Action>& actions, const belief::WorldState&) {
                   return off(belief::mean(own_of<belief::Grasp>(actions).grip->force), 20.0, 40.0);
                 }});
  all.push_back({"pull",
                 {0.1, belief::Pull{"cup", {0.2, 0.0, 0.0}, 1.0, belief::UniformScalar{10.0, 12.0}}},
                 {{"distance", {}, {}}, {"force", {}, {}}, {"direction", -90.0, 90.0}},
                 [](const Values& values, belief::Scene& scene) {
                   auto& pull = own_of<belief::Pull>(scene.actions);
                   pull.by = values.at("distance") * level(values.at("direction_deg"));
                   pull.force = belief::FixedScalar{values.at("force")};
                 },
                 [](const std::vector<Action>& actions, const belief::WorldState&) {
                   const auto& pull = own_of<belief::Pull>(actions);
                   return (pull.by - 0.4 * level(30.0)).norm() + off(belief::mean(pull.force), 20.0, 100.0);
                 }});
  all.push_back({"move_joint",
                 {0.1, belief::MoveJoint{"slide", belief::JointType::kSlider, 0.1}},
                 {{"to", {}, {}}, {"force", {}, {}}},
                 [](const Values& values, belief::Scene& scene) {
                   auto& move = own_of<belief::MoveJoint>(scene.actions);
                   move.to = values.at("to");
                   move.force = belief::FixedScalar{values.at("force")};
                 },
                 [](const std::vector<Action>& actions, const belief::WorldState&) {
                   const auto& move = own_of<belief::MoveJoint>(actions);
                   return off(move.to, 0.2, 1.0) + off(belief::mean(move.force), 50.0, 500.0);
                 }});
  all.push_back({"transport",
                 {1.0, carry_to({0.3, 0.4, 0.6}, 1.0)},
                 {{"speed", {}, {}}},
                 // From (0, 0, 0.6): half a metre.
                 [](const Values& values, belief::Scene& scene) {
                   own_of<belief::Transport>(scene.actions).duration = 0.5 / values.at("speed");
                 },
                 [](const std::vector<Action>& actions, const belief::WorldState&) {
                   return off(own_of<belief::Transport>(actions).duration, 0.6, 5.0);
                 },
                 true});
  return all;
}

std::shared_ptr<belief::Scene> scene_of(const Case& one) {
  auto scene = tests::sliding_scene();
  belief::SceneObject& carton = scene->objects[0];
  carton.held_by = "hand";
  geometry::Matrix6d covariance = geometry::Matrix6d::Zero();
  covariance.diagonal().tail<3>().setConstant(1e-8);
  carton.pose = belief::NormalPose{Pose::from_translation({0.0, 0.0, 0.5}), covariance};
  scene->robot[0].timeline = {{0.0, Pose::from_translation({0.0, 0.0, 0.75})}};
  belief::Joint slide;
  slide.name = "slide";
  slide.type = belief::JointType::kSlider;
  slide.parent = "table";
  slide.child = "cup";
  slide.axis_P = Vector3d::UnitX();
  slide.X_PC0 = scene->supports[0].X_WS.inverse() * std::get<belief::FixedPose>(scene->objects[1].pose).X_WO;
  slide.low = 0.0;
  slide.high = 0.4;
  if (one.kind == "move_joint") scene->joints = {slide};
  if (one.carried) scene->actions.push_back({0.3, carry_to({0.0, 0.0, 0.6})});
  scene->actions.push_back(one.own);
  scene->exclusive_outcomes.clear();
  scene->outcomes = {{"stays", "carton", {belief::Condition{belief::BelowHeight{-0.5}, belief::When::kAtEnd, true}}}};
  return scene;
}

AchieveQuery question(const Case& one) {
  AchieveQuery query;
  query.outcome = "stays";
  query.action = one.kind;
  query.free = one.free;
  query.effort.exact_instances = 1500;
  return query;
}

/// The rougher the carton, the less the numbers may be off.
tests::FakeSimulator::Formula law_of(const Case& one) {
  return [miss = one.miss](const belief::WorldState& start, const simulation::RunRequest& request, core::RandomStream) {
    belief::WorldState end = start;
    if (start.objects[0].physical.friction > 0.85 - miss(request.actions, start))
      end.objects[0].X_WO.translation.z() -= 2.0;
    return end;
  };
}

Answer ask(const Case& one, const AchieveQuery& query, int threads = 2) {
  core::ThreadPool pool(threads);
  return queries::answer(scene_of(one), 1, {"q", query}, tests::context_with(law_of(one), pool));
}

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
