// SPDX-License-Identifier: Apache-2.0
// How things are related: laws of the relations, and scenes whose truth is known, simulated or placed by hand.
#include "prescene/queries/relations.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>

#include "prescene/belief/json.h"
#include "prescene/geometry/angles.h"
#include "prescene/simulation/bullet/bullet_simulator.h"
#include "tests/support/simple_scenes.h"

namespace prescene::queries::relations_test {
namespace {

using belief::RelationKind;
using geometry::Pose;
using geometry::Vector3d;
using testing::HasSubstr;
using tests::add_object;
using tests::model_of;
using tests::primitive_model;

simulation::ShapeStore& shapes() {
  static simulation::ShapeStore store;
  return store;
}

QueryContext context_with(core::ThreadPool& pool) {
  QueryContext context;
  context.pool = &pool;
  context.make_simulator = [](const belief::Scene& scene, double) {
    return simulation::make_bullet_simulator(scene, shapes());
  };
  return context;
}

/// A table whose top is z = 0, seen by a camera from the side.
belief::Scene table_scene() {
  belief::Scene scene;
  scene.name = "relations";
  scene.supports.push_back(tests::support_of("table",
                                             {belief::PrimitiveShape{geometry::BoxShape{{1.0, 1.0, 0.04}}, {}}},
                                             Pose::from_translation({0.0, 0.0, -0.02})));
  belief::SceneCamera camera;
  camera.intrinsics = {160, 120, 150.0, 150.0, 79.5, 59.5};
  // Looks along +y from 1 m away, image right is +x.
  Eigen::Matrix3d R;
  R << 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0;
  camera.X_WC = {geometry::Quaterniond(R), {0.0, -1.0, 0.1}};
  scene.camera = camera;
  return scene;
}

void place(belief::Scene& scene, int object, const Pose& X_WO) {
  scene.objects[static_cast<std::size_t>(object)].pose = belief::FixedPose{X_WO};
}

/// The belief of what is where the scene places it, known to a standard deviation (m, and rad of 1 %).
belief::Belief belief_of(const belief::Scene& scene, double deviation) {
  belief::Belief belief;
  belief.step = 30;
  belief.seed = 5;
  belief.scene = std::make_shared<const belief::Scene>(scene);
  belief.X_WC = scene.camera->X_WC;
  for (const belief::KinematicBody& body : scene.robot) belief.robot.push_back(belief::pose_at(body, 0.0));
  for (const belief::SceneObject& object : scene.objects) {
    belief::ObjectBelief& known = belief.objects.emplace_back();
    known.name = object.name;
    known.model = object.model;
    belief::Particle particle;
    particle.X_WO = belief::mean(object.pose);
    particle.covariance.diagonal().segment<3>(3).setConstant(deviation * deviation);
    particle.mode = object.held_by ? belief::MotionMode::kHeld : belief::MotionMode::kResting;
    known.particles = {particle};
    known.motion.X_still = particle.X_WO;
    known.motion.still_frames = object.held_by ? 0 : 30;
  }
  return belief;
}

/// Where everything lies after `seconds`.
belief::Scene settled(belief::Scene scene, double seconds) {
  const auto simulator = simulation::make_bullet_simulator(scene, shapes());
  EXPECT_TRUE(simulator.ok()) << simulator.status().message();
  simulation::RunRequest request;
  request.stop.duration = seconds;
  const belief::Trajectory run = tests::run_one(**simulator, belief::mean_start(scene), request);
  for (std::size_t i = 0; i < scene.objects.size(); ++i) place(scene, static_cast<int>(i), run.final().objects[i].X_WO);
  return scene;
}

/// Probabilities by "on carton table"; what is not named is 0.
class Found {
 public:
  explicit Found(core::Result<belief::RelationsAnswer> answer) {
    EXPECT_TRUE(answer.ok()) << answer.status().message();
    if (answer) answer_ = *std::move(answer);
    for (const belief::RelationProbability& relation : answer_.relations) {
      EXPECT_LE(relation.low, relation.probability);
      EXPECT_GE(relation.high, relation.probability);
      by_text_[key(relation)] = relation.probability;
    }
  }
  double operator()(const std::string& text) const {
    const auto found = by_text_.find(text);
    return found == by_text_.end() ? 0.0 : found->second;
  }
  const belief::RelationsAnswer& answer() const { return answer_; }
  const std::map<std::string, double>& all() const { return by_text_; }
  static std::string key(const belief::RelationProbability& relation) {
    return to_string(relation.relation) + " " + relation.subject + (relation.other.empty() ? "" : " " + relation.other);
  }

 private:
  belief::RelationsAnswer answer_;
  std::map<std::string, double> by_text_;
};

void set_reach(belief::RelationsQuery& query, const std::string& of, const Vector3d& point_W, double radius) {
  belief::Reach& reach = query.reach.emplace();
  reach.of = of;
  reach.point_W = point_W;
  reach.radius = radius;
}

belief::RelationsQuery with_draws(int draws) {
  belief::RelationsQuery query;
  query.draws = draws;
  return query;
}

Found ask(const belief::Belief& belief, const belief::RelationsQuery& query = with_draws(64)) {
  core::ThreadPool pool(2);
  return Found(relations(belief, query, context_with(pool)));
}

Found ask(const belief::Scene& scene, const belief::RelationsQuery& query = with_draws(64)) {
  core::ThreadPool pool(2);
  return Found(relations(std::make_shared<const belief::Scene>(scene), 1, query, context_with(pool)));
}

core::Status error_of(const belief::Belief& belief, const belief::RelationsQuery& query) {
  core::ThreadPool pool(1);
  return relations(belief, query, context_with(pool)).status();
}

belief::Scene stack_of_three() {
  belief::Scene scene = table_scene();
  double top = 0.0;
  for (const auto& [name, size] : {std::pair("low", 0.12), std::pair("middle", 0.09), std::pair("high", 0.06)}) {
    const int i = add_object(scene, primitive_model(name, geometry::BoxShape{Vector3d::Constant(size)}), name);
    place(scene, i, Pose::from_translation({0.01, 0.0, top + 0.5 * size}));
    top += size;
  }
  return scene;
}

TEST(Relations, AStackOfThreeRestsOneOnTheOther) {
  for (const Found& found : {ask(stack_of_three()), ask(belief_of(stack_of_three(), 0.002))}) {
    EXPECT_GT(found("on low table"), 0.98);
    EXPECT_GT(found("on middle low"), 0.98);
    EXPECT_GT(found("on high middle"), 0.98);
    EXPECT_EQ(found("on high low"), 0.0);
    EXPECT_EQ(found("on middle table"), 0.0);
    EXPECT_EQ(found("on low middle"), 0.0);
    EXPECT_GT(found("upright high"), 0.98);
    for (const auto& [text, probability] : found.all()) EXPECT_NE(text.substr(0, 3), "in ") << text;
  }
}

TEST(Relations, OnIsMirroredBySupportsIsATouchAndIsNeverMutual) {
  // Heaps in which contacts are anything: boxes that overlap, lean and float.
  core::RandomStream random(11, core::Purpose::kTest);
  int seen = 0;
  for (int heap = 0; heap < 6; ++heap) {
    belief::Scene scene = table_scene();
    for (const char* name : {"a", "b", "c", "d"}) {
      const double height = random.uniform(0.04, 0.1), depth = random.uniform(0.04, 0.1),
                   width = random.uniform(0.04, 0.1);
      const Vector3d size(width, depth, height);
      const int i = add_object(scene, primitive_model(name, geometry::BoxShape{size}), name);
      const double angle = random.uniform(0.0, 6.0);
      place(scene, i,
            {tests::about({0.3, random.uniform(), 1.0}, angle),
             {random.uniform(-0.08, 0.08), random.uniform(-0.08, 0.08), random.uniform(0.03, 0.12)}});
    }
    const Found found = ask(belief_of(scene, 0.01), with_draws(32));
    for (const belief::RelationProbability& relation : found.answer().relations) {
      const std::string mirrored = relation.other + " " + relation.subject;
      if (relation.relation == RelationKind::kSupports) {
        EXPECT_EQ(found("on " + mirrored), relation.probability) << mirrored;
      }
      if (relation.relation != RelationKind::kOn) continue;
      ++seen;
      EXPECT_EQ(found("supports " + mirrored), relation.probability) << mirrored;
      EXPECT_LE(relation.probability + found("on " + mirrored), 1.0 + 1e-12) << mirrored;
      const double touches =
          std::max(found("touches " + mirrored), found("touches " + relation.subject + " " + relation.other));
      EXPECT_GE(touches, relation.probability) << mirrored;
    }
  }
  EXPECT_GT(seen, 10);
}

TEST(Relations, HypothesesOfOneHalfEachGiveOneHalf) {
  belief::Scene scene = table_scene();
  const int block = add_object(scene, primitive_model("block", geometry::BoxShape{Vector3d::Constant(0.1)}), "block");
  const int box = add_object(scene, primitive_model("box", geometry::BoxShape{Vector3d::Constant(0.06)}), "box");
  place(scene, block, Pose::from_translation({0.0, 0.0, 0.05}));
  place(scene, box, Pose::from_translation({0.0, 0.0, 0.13}));
  belief::Belief belief = belief_of(scene, 0.001);
  belief::Particle beside = belief.objects[1].particles[0];
  beside.X_WO.translation = {0.3, 0.0, 0.03};
  belief.objects[1].particles.push_back(beside);
  for (belief::Particle& particle : belief.objects[1].particles) particle.log_weight = std::log(0.5);
  const Found found = ask(belief);
  EXPECT_EQ(found("on box block"), 0.5);
  EXPECT_EQ(found("on box table"), 0.5);
  EXPECT_EQ(found("touches block box") + found("touches box block"), 0.5);
  EXPECT_EQ(found("on block table"), 1.0);
  for (const auto& item : found.answer().objects)
    EXPECT_NEAR(*item.effective_sample_size, item.object == "box" ? 2.0 : 1.0, 1e-9);
}

TEST(Relations, TurningAndShiftingEverythingAboutTheVerticalChangesNothing) {
  const belief::Scene scene = stack_of_three();
  belief::RelationsQuery query = with_draws(64);
  set_reach(query, "", Vector3d(0.0, -0.1, 0.0), 0.2);
  const Found before = ask(scene, query);
  for (const double turn : {0.4, 2.0}) {
    const Pose X{tests::about(Vector3d::UnitZ(), turn), {0.3, -0.2, 0.05}};
    belief::Scene moved = scene;
    for (belief::SceneObject& object : moved.objects) object.pose = belief::FixedPose{X * belief::mean(object.pose)};
    for (belief::Support& support : moved.supports) support.X_WS = X * support.X_WS;
    moved.camera->X_WC = X * moved.camera->X_WC;
    belief::RelationsQuery there = query;
    there.reach->point_W = X * query.reach->point_W;
    EXPECT_EQ(ask(moved, there).all(), before.all()) << turn;
  }
}

TEST(Relations, OneThreadGivesTheBitsOfTwo) {
  const belief::Belief belief = belief_of(stack_of_three(), 0.003);
  core::ThreadPool one(1), two(2);
  const auto a = relations(belief, with_draws(64), context_with(one));
  const auto b = relations(belief, with_draws(64), context_with(two));
  ASSERT_TRUE(a.ok() && b.ok());
  EXPECT_EQ(*a, *b);
}

TEST(Relations, ABallBesideABoxTouchesItOnlyWhereItDoes) {
  for (const auto& [gap, touches] : {std::pair(0.005, 0.0), std::pair(0.0, 1.0)}) {
    belief::Scene scene = table_scene();
    const int box = add_object(scene, primitive_model("box", geometry::BoxShape{Vector3d::Constant(0.1)}), "box");
    const int ball = add_object(scene, primitive_model("ball", geometry::Sphere{0.03}), "ball");
    scene.models[1].symmetry = geometry::SymmetryGroup::every_rotation();
    place(scene, box, Pose::from_translation({0.0, 0.0, 0.05}));
    place(scene, ball, Pose::from_translation({0.08 + gap, 0.0, 0.03}));
    const Found exact = ask(scene);
    EXPECT_EQ(exact("touches box ball"), touches);
    EXPECT_EQ(exact("on ball table"), 1.0);
    EXPECT_EQ(exact("on ball box"), 0.0);
    EXPECT_EQ(exact.all().count("upright ball"), 0u) << "a ball has no side";
    if (gap > 0.0) {
      const Found found = ask(belief_of(scene, 0.001), with_draws(128));
      EXPECT_LT(found("touches box ball"), 0.01) << "five millimetres are more than three deviations of both";
      EXPECT_GT(found("on ball table"), 0.98) << "gaps that can't be told from none are closed";
    }
  }
}

TEST(Relations, WhatFloatsIsOnNothing) {
  belief::Scene scene = table_scene();
  const int box = add_object(scene, primitive_model("box", geometry::BoxShape{Vector3d::Constant(0.1)}), "box");
  place(scene, box, Pose::from_translation({0.0, 0.0, 0.051}));
  EXPECT_EQ(ask(scene)("on box table"), 0.0) << "its place is known exactly";
  place(scene, box, Pose::from_translation({0.0, 0.0, 0.15}));
  belief::Belief belief = belief_of(scene, 0.005);
  belief.objects[0].motion.still_frames = 0;
  EXPECT_EQ(ask(belief)("on box table"), 0.0);
}

TEST(Relations, ATippedBottleIsNotUpright) {
  belief::Scene scene = table_scene();
  const int stands = add_object(scene, primitive_model("bottle", geometry::Cylinder{0.03, 0.2}), "stands");
  const int lies = add_object(scene, scene.models[0], "lies");
  const int head = add_object(scene, scene.models[0], "on_its_head");
  scene.models.resize(1);
  for (belief::SceneObject& object : scene.objects) object.model = 0;
  place(scene, stands, Pose::from_translation({-0.2, 0.0, 0.1}));
  place(scene, lies, {tests::about(Vector3d::UnitY(), 0.5 * std::numbers::pi), {0.0, 0.0, 0.03}});
  place(scene, head, {tests::about(Vector3d::UnitY(), std::numbers::pi), {0.25, 0.0, 0.1}});
  const Found found = ask(scene);
  EXPECT_EQ(found("upright stands"), 1.0);
  EXPECT_EQ(found("upright lies"), 0.0);
  EXPECT_EQ(found("upright on_its_head"), 0.0);
  scene.models[0].symmetry = geometry::SymmetryGroup::continuous(Vector3d::UnitZ(), true);
  const Found symmetric = ask(scene);
  EXPECT_EQ(symmetric("upright on_its_head"), 1.0) << "nothing tells its ends apart";
  EXPECT_EQ(symmetric("upright lies"), 0.0);
}

belief::ObjectModel mug_model(double handle) {
  const auto cup = std::make_shared<const geometry::TriangleMesh>(
      geometry::make_lathe({{0.0, 0.0}, {0.04, 0.0}, {0.04, 0.09}, {0.037, 0.09}, {0.037, 0.004}, {0.0, 0.004}}, 32));
  belief::MeshShape hollow{cup, {}, belief::MeshUse::kSpheres};
  hollow.spheres.count = 1000;
  std::vector<belief::CollisionShape> parts{hollow};
  if (handle > 0.0) {
    const geometry::Quaterniond across = tests::about(Vector3d::UnitY(), 0.5 * std::numbers::pi);
    parts.emplace_back(belief::PrimitiveShape{geometry::Capsule{0.005, 0.03}, {across, {0.0525, 0.0, 0.07}}});
    parts.emplace_back(
        belief::PrimitiveShape{geometry::Capsule{0.005, 0.04}, Pose::from_translation({0.0675, 0.0, 0.05})});
    parts.emplace_back(belief::PrimitiveShape{geometry::Capsule{0.005, 0.03}, {across, {0.0525, 0.0, 0.03}}});
  }
  return model_of("mug", std::move(parts), 0.3);
}

TEST(Relations, ASpoonInAMugIsInItAndOnItAndTheMugIsInNothing) {
  belief::Scene scene = table_scene();
  const int mug = add_object(scene, mug_model(0.0), "mug");
  const int spoon = add_object(scene, primitive_model("spoon", geometry::Capsule{0.004, 0.12}, 0.03), "spoon");
  place(scene, mug, Pose::from_translation({0.0, 0.0, 0.0001}));
  place(scene, spoon, {tests::about(Vector3d::UnitY(), 0.25), {0.0, 0.0, 0.075}});
  const belief::Scene rests = settled(scene, 2.0);
  for (const Found& found : {ask(rests), ask(belief_of(rests, 0.0005))}) {
    EXPECT_GT(found("in spoon mug"), 0.9);
    EXPECT_GT(found("on spoon mug"), 0.9);
    EXPECT_GT(found("on mug table"), 0.9);
    EXPECT_EQ(found("in mug spoon"), 0.0);
    EXPECT_EQ(found("in spoon table"), 0.0);
    EXPECT_LT(found("on spoon table"), 0.05) << "drawn into the wall, it may be pushed through the bottom";
  }
  place(scene, spoon, {tests::about(Vector3d::UnitY(), 0.5 * std::numbers::pi), {0.0, 0.0, 0.0945}});
  EXPECT_EQ(ask(scene)("in spoon mug"), 0.0) << "it lies across the rim";
}

TEST(Relations, AMugOnAHookIsOnTheHookAndNotInIt) {
  belief::Scene scene = table_scene();
  scene.supports.push_back(
      tests::support_of("hook", {belief::PrimitiveShape{geometry::Capsule{0.004, 0.2}, {}}},
                        {tests::about(Vector3d::UnitX(), 0.5 * std::numbers::pi), {0.0, 0.0, 0.3}}));
  const int mug = add_object(scene, mug_model(1.0), "mug");
  scene.models[0].contact.friction = belief::FixedScalar{0.8};
  place(scene, mug, Pose::from_translation({-0.055, 0.0, 0.24}));
  const belief::Scene hangs = settled(scene, 3.0);
  ASSERT_GT(belief::mean(hangs.objects[0].pose).translation.z(), 0.1) << "it fell off";
  const Found found = ask(belief_of(hangs, 0.0005));
  EXPECT_GT(found("on mug hook"), 0.9);
  EXPECT_EQ(found("on mug table"), 0.0);
  EXPECT_EQ(found("in mug hook"), 0.0);
}

TEST(Relations, WhatStandsBehindABoxIsHidden) {
  belief::Scene scene = table_scene();
  const int wall = add_object(scene, primitive_model("wall", geometry::BoxShape{{0.2, 0.02, 0.2}}), "wall");
  const int can = add_object(scene, primitive_model("can", geometry::Cylinder{0.03, 0.1}), "can");
  place(scene, wall, Pose::from_translation({0.0, -0.2, 0.1}));
  place(scene, can, Pose::from_translation({0.0, 0.0, 0.05}));
  const Found hidden = ask(scene);
  EXPECT_EQ(hidden("visible can"), 0.0);
  EXPECT_EQ(hidden("visible wall"), 1.0);
  // Half of it looks out to the right of the wall, seen from 1 m: at x = 0.1 * 1.0 / 0.79 where it stands.
  place(scene, can, Pose::from_translation({0.1 / 0.79, 0.0, 0.05}));
  const Found half = ask(scene);
  for (const belief::RelationProbability& relation : half.answer().relations) {
    if (Found::key(relation) != "visible can") continue;
    EXPECT_NEAR(relation.share.value_or(0.0), 0.5, 0.15);
  }
  place(scene, can, Pose::from_translation({0.0, -2.0, 0.05}));
  EXPECT_EQ(ask(scene)("visible can"), 0.0) << "it stands behind the camera";
}

TEST(Relations, WithinReachIsByTheNearestPointOfTheSurface) {
  belief::Scene scene = table_scene();
  const int box = add_object(scene, primitive_model("box", geometry::BoxShape{Vector3d::Constant(0.1)}), "box");
  place(scene, box, Pose::from_translation({0.3, 0.0, 0.05}));
  belief::RelationsQuery query = with_draws(16);
  for (const auto& [radius, within] : {std::pair(0.24, 0.0), std::pair(0.26, 1.0)}) {
    set_reach(query, "", Vector3d(0.0, 0.0, 0.05), radius);
    EXPECT_EQ(ask(scene, query)("within_reach box"), within) << radius;
  }
  set_reach(query, "", Vector3d(0.3, 0.0, 0.05), 0.01);
  EXPECT_EQ(ask(scene, query)("within_reach box"), 1.0) << "inside of it";
  set_reach(query, "camera", Vector3d::Zero(), 1.2);
  EXPECT_EQ(ask(scene, query)("within_reach box"), 1.0);
}

TEST(Relations, AHandHoldsWhatMovesWithIt) {
  belief::Scene scene = table_scene();
  belief::KinematicBody hand;
  hand.name = "hand";
  hand.collision.push_back(belief::PrimitiveShape{geometry::Sphere{0.02}, {}});
  hand.timeline = {{0.0, Pose::from_translation({0.0, 0.0, 0.4})}};
  scene.robot.push_back(hand);
  const int box = add_object(scene, primitive_model("box", geometry::BoxShape{Vector3d::Constant(0.1)}), "box");
  scene.objects[0].held_by = "hand";
  place(scene, box, Pose::from_translation({0.0, 0.0, 0.33}));
  const Found found = ask(belief_of(scene, 0.001));
  EXPECT_EQ(found("holds hand box"), 1.0);
  EXPECT_EQ(found("on box table"), 0.0);
}

TEST(Relations, BadQuestionsAreRefusedWithTheRemedy) {
  belief::Belief belief = belief_of(stack_of_three(), 0.001);
  belief::RelationsQuery query = with_draws(16);
  query.object = "midle";
  const core::Status unknown = error_of(belief, query);
  EXPECT_EQ(unknown.code(), core::StatusCode::kNotFound);
  EXPECT_THAT(unknown.message(), HasSubstr("did you mean 'middle'?"));
  query.object = "high";
  belief.objects[2].state = belief::TrackState::kLost;
  EXPECT_THAT(error_of(belief, query).message(), HasSubstr("it may be lost"));
  query.object.reset();
  set_reach(query, "kamera", Vector3d::Zero(), 1.0);
  EXPECT_THAT(error_of(belief, query).message(), HasSubstr("did you mean 'camera'?"));
  query.reach.reset();
  query.draws = 3;
  EXPECT_THAT(error_of(belief, query).message(), HasSubstr("give 16 to 4096"));
  query.draws = 16;
  for (belief::ObjectBelief& object : belief.objects) object.existence = 0.1;
  EXPECT_THAT(error_of(belief, query).message(), HasSubstr("no object is there now"));
  for (const auto& [text, message] :
       {std::pair(R"({"relations": {"objekt": "a"}})", "did you mean 'object'?"),
        std::pair(R"({"relations": {"draws": 5}})", "between 16 and 4096"),
        std::pair(R"({"relations": {"reach": {"radius": 1}}})", "'of' is missing"),
        std::pair(R"({"relations": {"reach": {"of": [0, 0, 0], "radius": -1}}})", "relations.reach.radius")})
    EXPECT_THAT(belief::query_from_json(text).status().message(), HasSubstr(message)) << text;
}

TEST(Relations, QuestionsReadBackAsTheyWereWritten) {
  belief::RelationsQuery query = with_draws(128);
  query.object = "mug";
  query.upright_within = 10.0 * geometry::kDegree;
  set_reach(query, "hand", Vector3d::Zero(), 0.5);
  const belief::Query asked{"7", query};
  const auto read = belief::query_from_json(belief::json_text(belief::to_json(asked)));
  ASSERT_TRUE(read.ok()) << read.status().message();
  EXPECT_EQ(belief::to_json(*read), belief::to_json(asked));
}

}  // namespace
}  // namespace prescene::queries::relations_test
