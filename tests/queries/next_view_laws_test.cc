// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "prescene/queries/query_engine.h"
#include "prescene/rendering/reference/reference_renderer.h"
#include "tests/support/simple_scenes.h"

namespace prescene::queries::next_view_laws_test {
namespace {

using belief::CandidateView;
using belief::NextViewAnswer;
using belief::NextViewQuery;
using belief::ViewAbout;
using geometry::Pose;
using geometry::Quaterniond;
using geometry::Vector3d;
using testing::HasSubstr;

constexpr double kMiddle = 0.3;  // m, height of the mug's centre: it hangs free

/// Looks at the mug from this side of the z axis, level.
Pose from_side(const Vector3d& towards, double distance) {
  geometry::Matrix3d R;
  R.col(2) = -towards;
  R.col(1) = -Vector3d::UnitZ();
  R.col(0) = R.col(1).cross(R.col(2));
  return {Quaterniond(R), Vector3d(0.0, 0.0, kMiddle) + distance * towards};
}

/// A block with a handle on its side +x, at y = +2 cm; half a turn about x brings the handle to y = -2 cm and the block
/// onto itself.
belief::ObjectModel mug() {
  const Pose at_side = Pose::from_translation({0.06, 0.02, 0.0});
  return tests::model_of("mug", {belief::PrimitiveShape{geometry::BoxShape{{0.08, 0.1, 0.12}}, {}},
                                 belief::PrimitiveShape{geometry::BoxShape{{0.04, 0.02, 0.06}}, at_side}});
}

belief::Particle particle(const Pose& X_WO, double weight, double deviation = 0.0) {
  belief::Particle result;
  result.X_WO = X_WO;
  result.log_weight = std::log(weight);
  result.covariance.setZero();
  result.covariance.diagonal().segment<3>(3).setConstant(deviation * deviation);
  return result;
}

/// The mug with the handle at +y or -y.
belief::Belief two_turns(double first = 0.5, double deviation = 0.0) {
  auto scene = std::make_shared<belief::Scene>();
  scene->name = "mug";
  scene->gravity_W = Vector3d::Zero();
  scene->models = {mug()};
  belief::SceneObject object;
  object.name = "mug";
  object.model = 0;
  object.pose = belief::FixedPose{Pose::from_translation({0.0, 0.0, kMiddle})};
  scene->objects = {object};
  belief::SceneCamera camera;
  camera.intrinsics = {160, 120, 200.0, 200.0, 79.5, 59.5};
  scene->camera = camera;
  belief::Belief belief;
  belief.step = 5;
  belief.seed = 11;
  belief.scene = scene;
  belief::ObjectBelief seen;
  seen.name = "mug";
  seen.model = 0;
  const Vector3d p_WO(0.0, 0.0, kMiddle);
  const Quaterniond half_turn(Eigen::AngleAxisd(std::numbers::pi, Vector3d::UnitX()));
  seen.particles = {particle(Pose::from_translation(p_WO), first, deviation),
                    particle({half_turn, p_WO}, 1.0 - first, deviation)};
  belief.objects = {seen};
  return belief;
}

NextViewAnswer asked(const belief::Belief& belief, std::vector<CandidateView> views,
                     ViewAbout about = ViewAbout::kPlace, int threads = 2) {
  core::ThreadPool pool(threads);
  QueryContext context;
  context.pool = &pool;
  context.make_renderer = []() -> core::Result<std::unique_ptr<rendering::Renderer>> {
    return rendering::make_reference_renderer();
  };
  NextViewQuery query;
  query.object = "mug";
  query.about = about;
  query.views = std::move(views);
  query.draws = 32;
  const belief::Answer answer = queries::answer(belief, {"", query}, context);
  EXPECT_TRUE(answer.error.ok()) << answer.error.message();
  return std::get<NextViewAnswer>(answer.what);
}

const NextViewAnswer::View& named(const NextViewAnswer& answer, const std::string& name) {
  for (const NextViewAnswer::View& view : answer.views)
    if (view.name == name) return view;
  ADD_FAILURE() << "no view " << name;
  return answer.views.front();
}

const CandidateView kFront{"front", from_side(-Vector3d::UnitX(), 0.6)};
const CandidateView kBack{"back", from_side(Vector3d::UnitX(), 0.6)};
const CandidateView kAway{"away", from_side(Vector3d::UnitX(), -5.0)};

TEST(NextView, WhatIsTurnedAwayIsToldApartFromTheOtherSideOnly) {
  const NextViewAnswer answer = asked(two_turns(), {kFront, kBack});
  ASSERT_EQ(answer.hypotheses.size(), 2U);
  EXPECT_NEAR(answer.entropy, std::numbers::ln2, 1e-9);
  const NextViewAnswer::View& front = named(answer, "front");
  EXPECT_EQ(front.reduction, 0.0);
  EXPECT_EQ(front.high, 0.0);
  EXPECT_GT(front.visible_pixels, 100) << "it is in sight all the same";
  EXPECT_EQ(answer.views.front().name, "back");
  EXPECT_GT(named(answer, "back").low, 0.2);
  EXPECT_TRUE(answer.any_tells);
  EXPECT_TRUE(answer.best_is_clear);
}

// By how much the object is off is no evidence for either, as it is the same of both.
TEST(NextView, APoseThatIsNotKnownExactlyDoesNotMakeTheFrontTell) {
  const NextViewAnswer answer = asked(two_turns(0.5, 0.004), {kFront, kBack});
  EXPECT_EQ(named(answer, "front").high, 0.0);
  EXPECT_GT(named(answer, "back").low, 0.1);
}

TEST(NextView, AViewThatDoesNotShowTheObjectTellsNothing) {
  const NextViewAnswer answer = asked(two_turns(), {kAway});
  EXPECT_EQ(answer.views[0].reduction, 0.0);
  EXPECT_EQ(answer.views[0].high, 0.0);
  EXPECT_EQ(answer.views[0].visible_pixels, 0);
  EXPECT_FALSE(answer.any_tells);
  EXPECT_FALSE(answer.best_is_clear);
  ASSERT_EQ(answer.remarks.size(), 1U);
  EXPECT_THAT(answer.remarks[0], HasSubstr("No candidate tells anything about where it is"));
}

TEST(NextView, AWallBeforeTheObjectLeavesNothingToTell) {
  belief::Belief belief = two_turns();
  auto scene = std::make_shared<belief::Scene>(*belief.scene);
  belief::Support wall;
  wall.name = "wall";
  wall.collision.push_back(belief::PrimitiveShape{geometry::BoxShape{{0.02, 2.0, 2.0}}, {}});
  wall.X_WS = Pose::from_translation({0.2, 0.0, 0.0});
  scene->supports.push_back(wall);
  belief.scene = scene;
  const NextViewAnswer answer = asked(belief, {kBack});
  EXPECT_EQ(answer.views[0].high, 0.0);
  EXPECT_EQ(answer.views[0].visible_pixels, 0);
}

TEST(NextView, PlacesWithoutACommonPixelAreToldApartEntirely) {
  for (const double first : {0.5, 0.9}) {
    belief::Belief belief = two_turns(first);
    belief.objects[0].particles[1].X_WO.translation.y() = 0.15;
    const NextViewAnswer answer = asked(belief, {kFront});
    const double entropy = -first * std::log(first) - (1.0 - first) * std::log(1.0 - first);
    EXPECT_NEAR(answer.entropy, entropy, 1e-9);
    EXPECT_NEAR(answer.views[0].reduction, entropy, 1e-3);
    EXPECT_LE(answer.views[0].high, answer.entropy);
  }
}

TEST(NextView, ExistenceIsToldWhereTheObjectWouldBeSeenAlsoOfOneThatIsProbablyNotThere) {
  belief::Belief belief = two_turns();
  belief.objects[0].existence = 0.3;
  const NextViewAnswer answer = asked(belief, {kFront, kAway}, ViewAbout::kExistence);
  ASSERT_EQ(answer.hypotheses.size(), 2U);
  EXPECT_NEAR(answer.hypotheses[0].probability, 0.3, 1e-12);
  EXPECT_FALSE(answer.hypotheses[1].X_WO.has_value());
  EXPECT_NEAR(named(answer, "front").reduction, answer.entropy, 0.01);
  EXPECT_EQ(named(answer, "away").high, 0.0);
}

// No view can tell more than there is to tell, nor less than nothing; nearer ones tell more of a pose.
TEST(NextView, ReductionsAreWithinTheEntropyAndOfAPoseLargerFromNear) {
  const belief::Belief belief = two_turns(0.5, 0.02);
  const NextViewAnswer answer =
      asked(belief, {kFront, kBack, kAway, {"far", from_side(-Vector3d::UnitX(), 2.3)}}, ViewAbout::kPose);
  EXPECT_EQ(answer.hypotheses.size(), 32U);
  for (const NextViewAnswer::View& view : answer.views) {
    EXPECT_GE(view.low, 0.0);
    EXPECT_LE(view.low, view.reduction);
    EXPECT_LE(view.reduction, view.high);
    EXPECT_LE(view.high, answer.entropy);
  }
  EXPECT_GT(named(answer, "front").low, named(answer, "far").high);
  EXPECT_EQ(named(answer, "away").high, 0.0);
}

TEST(NextView, WhereThereIsNoDoubtNothingIsToBeTold) {
  belief::Belief belief = two_turns();
  belief.objects[0].particles.resize(1);
  belief.objects[0].particles[0].log_weight = 0.0;
  const NextViewAnswer answer = asked(belief, {kBack});
  EXPECT_EQ(answer.entropy, 0.0);
  EXPECT_EQ(answer.views[0].high, 0.0);
  ASSERT_EQ(answer.remarks.size(), 1U);
  EXPECT_THAT(answer.remarks[0], HasSubstr("has no doubt about where it is"));
}

TEST(NextView, ThreadsDoNotChangeTheAnswer) {
  const belief::Belief belief = two_turns(0.4, 0.004);
  EXPECT_EQ(asked(belief, {kFront, kBack}, ViewAbout::kPose, 1), asked(belief, {kFront, kBack}, ViewAbout::kPose, 3));
}

}  // namespace
}  // namespace prescene::queries::next_view_laws_test
