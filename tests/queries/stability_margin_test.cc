// SPDX-License-Identifier: Apache-2.0
// How hard a thing may be knocked, and what its removal does: against thresholds of known distribution, and against
// mechanics.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "prescene/belief/json.h"
#include "prescene/core/random.h"
#include "prescene/queries/confidence_sequence.h"
#include "prescene/queries/query_engine.h"
#include "prescene/simulation/bullet/bullet_simulator.h"
#include "prescene/simulation/bullet/convex_decomposition.h"
#include "sliding_scene.h"

namespace prescene::queries {
namespace {

using belief::StabilityAnswer;
using geometry::Vector3d;
using testing::HasSubstr;

belief::Query asking(const std::string& object, bool margin, bool removal) {
  belief::StabilityQuery query;
  query.object = object;
  query.detail.margin = margin;
  query.detail.removal = removal;
  return {"", query};
}

/// Tips over when it moves along +y faster than a threshold that its y decides: normal, 0.5 m/s with a deviation of
/// 0.1.
belief::WorldState tip_beyond_threshold(const belief::WorldState& start, const simulation::RunRequest&,
                                        core::RandomStream) {
  belief::WorldState end = start;
  const belief::ObjectState& carton = start.objects[0];
  if (carton.V_WO.linear.y() > 0.5 + 5.0 * carton.X_WO.translation.y())
    end.objects[0].X_WO.rotation = geometry::exp_rotation({1.5, 0.0, 0.0}) * carton.X_WO.rotation;
  return end;
}

TEST(StabilityMargin, IntervalsHoldTheQuantilesOfKnownThresholds) {
  core::ThreadPool pool(2);
  auto scene = tests::sliding_scene();
  geometry::Matrix6d covariance = geometry::Matrix6d::Zero();
  covariance(4, 4) = 4e-4;
  scene->objects[0].pose = belief::NormalPose{geometry::Pose::from_translation({0.0, 0.0, 0.1}), covariance};
  const double mass = 0.5;
  int held = 0, asked = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const belief::Answer answer =
        queries::answer(scene, seed, asking("carton", true, false), tests::context_with(tip_beyond_threshold, pool));
    ASSERT_TRUE(answer.error.ok()) << answer.error.message();
    const auto& margin = std::get<StabilityAnswer>(answer.what).margin;
    ASSERT_TRUE(margin);
    EXPECT_NEAR(margin->weakest_W.y(), 1.0, 1e-12);
    EXPECT_EQ(margin->starts, 128);
    ASSERT_EQ(margin->directions.size(), 8u);
    EXPECT_FALSE(margin->directions[6].impulse) << "knocked along -y it never falls";
    ASSERT_EQ(margin->falls.size(), 2u);
    for (const belief::FallImpulse& fall : margin->falls) {
      const double truth = mass * (0.5 + 0.1 * core::inverse_normal_cdf(fall.share));
      ASSERT_TRUE(fall.impulse && fall.low && fall.high);
      EXPECT_LE(*fall.low, *fall.impulse);
      EXPECT_GE(*fall.high, *fall.impulse);
      ++asked;
      held += *fall.low <= 1.03 * truth && *fall.high >= truth;  // speeds are found to 2.7 %
    }
  }
  // Of 40 intervals of 95 %, fewer than 34 hold the truth with a probability of 0.4 %.
  EXPECT_GE(held, 34) << "of " << asked;
}

TEST(StabilityMargin, OneThreadGivesTheBitsOfTwo) {
  core::ThreadPool one(1), two(2);
  const auto text = [&](core::ThreadPool& pool) {
    belief::Answer answer = queries::answer(tests::sliding_scene(), 5, asking("carton", true, true),
                                            tests::context_with(tip_beyond_threshold, pool));
    auto& told = std::get<StabilityAnswer>(answer.what);
    told.wall_seconds = told.cpu_seconds = 0.0;
    return belief::json_text(belief::to_json(answer));
  };
  EXPECT_EQ(text(one), text(two));
}

TEST(StabilityMargin, WhatIsHeldHasNone) {
  core::ThreadPool pool(1);
  belief::Belief belief = tests::two_hypotheses();
  for (belief::Particle& particle : belief.objects[0].particles) particle.mode = belief::MotionMode::kHeld;
  const belief::Answer answer =
      queries::answer(belief, asking("carton", true, false), tests::context_with(tests::slide, pool));
  EXPECT_THAT(answer.error.message(), HasSubstr("is held by 'hand'"));
}

TEST(QuantileInterval, OfFewDrawsHasOpenEnds) {
  const double never = std::numeric_limits<double>::infinity();
  const std::vector<double> draws = {1.0, 2.0, 3.0, 4.0, never, never};
  const QuantileInterval low = quantile_interval(draws, 0.05, 0.05);
  EXPECT_EQ(low.value, 1.0);
  EXPECT_EQ(low.low, -never) << "six draws may all lie above a twentieth";
  EXPECT_EQ(low.high, 3.0);  // two or more below it: 0.033, three or more: 0.002
  const QuantileInterval half = quantile_interval(draws, 0.5, 0.05);
  EXPECT_EQ(half.value, 3.0);
  EXPECT_EQ(half.low, 1.0);  // none below it: 1/64
  EXPECT_EQ(half.high, never);
}

TEST(QuantileInterval, HoldsTheQuantileAsOftenAsItSays) {
  constexpr int kRounds = 2000, kDraws = 60;
  int held = 0;
  core::RandomStream random = core::RandomStream(7, core::Purpose::kTest);
  for (int round = 0; round < kRounds; ++round) {
    std::vector<double> draws(kDraws);
    for (double& draw : draws) draw = random.uniform();
    std::sort(draws.begin(), draws.end());
    const QuantileInterval interval = quantile_interval(draws, 0.3, 0.1);
    held += interval.low <= 0.3 && interval.high >= 0.3;
  }
  EXPECT_GE(held, 0.88 * kRounds);
}

/// Boxes that stand on a floor, through the real simulator.
class Boxes : public testing::Test {
 protected:
  Boxes() : shapes_(simulation::hacd_decomposer()), scene_(std::make_shared<belief::Scene>()) {
    scene_->name = "boxes";
    belief::Support floor;
    floor.name = "floor";
    floor.collision.push_back(belief::PrimitiveShape{geometry::BoxShape{{4.0, 4.0, 0.2}}, {}});
    floor.X_WS = geometry::Pose::from_translation({0.0, 0.0, -0.1});
    floor.contact.friction = belief::FixedScalar{1.0};
    scene_->supports = {floor};
  }

  void add(const std::string& name, const Vector3d& size, const Vector3d& p_WO, double mass) {
    belief::ObjectModel model = tests::box_model(name, size);
    model.mass = belief::FixedScalar{mass};
    model.contact.friction = belief::FixedScalar{0.9};
    scene_->models.push_back(*belief::with_derived_properties(model));
    belief::SceneObject object;
    object.name = name;
    object.model = static_cast<int>(scene_->models.size()) - 1;
    object.pose = belief::FixedPose{geometry::Pose::from_translation(p_WO)};
    scene_->objects.push_back(object);
  }

  StabilityAnswer answer(const belief::Query& query) {
    QueryContext context;
    context.pool = &pool_;
    context.make_simulator = [&](const belief::Scene& asked, double) {
      return simulation::make_bullet_simulator(asked, shapes_, {});
    };
    const belief::Answer answer = queries::answer(scene_, 1, query, context);
    EXPECT_TRUE(answer.error.ok()) << answer.error.message();
    return std::get<StabilityAnswer>(answer.what);
  }

  core::ThreadPool pool_{2};
  simulation::ShapeStore shapes_;
  std::shared_ptr<belief::Scene> scene_;
};

TEST_F(Boxes, ASlabFallsAcrossItsThinSideAndItsMarginGrowsWithItsMass) {
  add("slab", {0.04, 0.12, 0.2}, {0.0, 0.0, 0.1}, 0.3);
  const StabilityAnswer light = answer(asking("slab", true, false));
  ASSERT_TRUE(light.margin);
  EXPECT_GT(std::abs(light.margin->weakest_W.x()), 0.7);
  ASSERT_TRUE(light.margin->falls[1].impulse);
  // To tip over its edge it takes at least the energy that lifts its centre of mass over that edge.
  const double lift = std::hypot(0.02, 0.1) - 0.1;
  EXPECT_GE(*light.margin->falls[1].impulse, 0.3 * std::sqrt(2.0 * 9.81 * lift));
  scene_->models[0].mass = belief::FixedScalar{1.2};
  scene_->models[0] = *belief::with_derived_properties(scene_->models[0]);
  const StabilityAnswer heavy = answer(asking("slab", true, false));
  ASSERT_TRUE(heavy.margin && heavy.margin->falls[1].impulse);
  EXPECT_NEAR(*heavy.margin->falls[1].impulse / *light.margin->falls[1].impulse, 4.0, 0.3);
}

TEST_F(Boxes, WhoeverCarriesAnotherCannotBeTakenAway) {
  add("lower", {0.1, 0.1, 0.1}, {0.0, 0.0, 0.05}, 0.5);
  add("upper", {0.08, 0.08, 0.08}, {0.0, 0.0, 0.14}, 0.3);
  add("beside", {0.1, 0.1, 0.1}, {0.4, 0.0, 0.05}, 0.5);
  const StabilityAnswer lower = answer(asking("lower", false, true));
  ASSERT_TRUE(lower.removal);
  EXPECT_LT(lower.removal->others_stay.high, 0.05);
  ASSERT_EQ(lower.removal->moves.size(), 2u);
  EXPECT_EQ(lower.removal->moves[0].name, "upper");
  EXPECT_EQ(lower.removal->moves[0].probability, 1.0);
  EXPECT_EQ(lower.removal->moves[1].probability, 0.0);
  const StabilityAnswer upper = answer(asking("upper", false, true));
  ASSERT_TRUE(upper.removal);
  EXPECT_EQ(upper.removal->others_stay.probability, 1.0);
}

}  // namespace
}  // namespace prescene::queries
