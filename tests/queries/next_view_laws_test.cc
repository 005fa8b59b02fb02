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

/// A wall across the x axis.
belief::Belief with_wall(belief::Belief belief, double x) {
  auto scene = std::make_shared<belief::Scene>(*belief.scene);
  belief::Support wall;
  wall.name = "wall";
  wall.collision.push_back(belief::PrimitiveShape{geometry::BoxShape{{0.02, 2.0, 2.0}}, {}});
  wall.X_WS = Pose::from_translation({x, 0.0, 0.0});
  scene->supports.push_back(wall);
  belief.scene = scene;
  return belief;
}

NextViewQuery question(std::vector<CandidateView> views, ViewAbout about = ViewAbout::kPlace) {
  NextViewQuery query;
  query.object = "mug";
  query.about = about;
  query.views = std::move(views);
  query.draws = 32;
  return query;
}

belief::Answer answer_to(const belief::Belief& belief, const NextViewQuery& query, QueryContext context = {},
                         int threads = 2) {
  core::ThreadPool pool(threads);
  context.pool = &pool;
  context.make_renderer = []() -> core::Result<std::unique_ptr<rendering::Renderer>> {
    return rendering::make_reference_renderer();
  };
  return queries::answer(belief, {"", query}, context);
}

NextViewAnswer asked(const belief::Belief& belief, std::vector<CandidateView> views,
                     ViewAbout about = ViewAbout::kPlace, int threads = 2) {
  const belief::Answer answer = answer_to(belief, question(std::move(views), about), {}, threads);
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
  const NextViewAnswer answer = asked(with_wall(two_turns(), 0.2), {kBack});
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
  }
}

TEST(NextView, ExistenceIsToldWhereTheObjectWouldBeSeenAlsoOfOneThatIsProbablyNotThere) {
  belief::Belief belief = two_turns();
  belief.objects[0].existence = 0.3;
  const NextViewAnswer answer = asked(with_wall(belief, 0.5), {kFront, kAway}, ViewAbout::kExistence);
  ASSERT_EQ(answer.hypotheses.size(), 2U);
  EXPECT_NEAR(answer.hypotheses[0].probability, 0.3, 1e-12);
  EXPECT_FALSE(answer.hypotheses[1].X_WO.has_value());
  EXPECT_NEAR(named(answer, "front").reduction, answer.entropy, 0.01);
  EXPECT_EQ(named(answer, "away").high, 0.0);
}

// Empty space returns nothing, and whether it does is not known: that nothing comes back is no evidence of absence.
TEST(NextView, BeforeEmptySpaceOnlyPresenceIsTold) {
  belief::Belief belief = two_turns();
  belief.objects[0].existence = 0.3;
  const NextViewAnswer answer = asked(belief, {kFront}, ViewAbout::kExistence);
  EXPECT_NEAR(answer.views[0].reduction, -0.3 * std::log(0.3), 0.01);
}

TEST(NextView, OfAPoseNearerViewsTellMore) {
  const belief::Belief belief = two_turns(0.5, 0.02);
  const NextViewAnswer answer =
      asked(belief, {kFront, kBack, kAway, {"far", from_side(-Vector3d::UnitX(), 2.3)}}, ViewAbout::kPose);
  EXPECT_EQ(answer.hypotheses.size(), 32U);
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

// 80 x 60 pixels, weighed by 256 images each, from 64 places.
TEST(NextView, MoreWorkThanAQuestionMayTakeIsRefusedWithARemedy) {
  NextViewQuery query = question(std::vector<CandidateView>(64, kFront));
  query.draws = 256;
  const belief::Answer answer = answer_to(two_turns(), query);
  EXPECT_EQ(answer.error.code(), core::StatusCode::kResourceExhausted);
  EXPECT_THAT(answer.error.message(), HasSubstr("fewer 'views'"));
}

TEST(NextView, MoreMemoryThanAQuestionMayTakeIsRefusedWithARemedy) {
  QueryContext context;
  context.most_bytes = 1 << 20;
  const belief::Answer answer = answer_to(two_turns(), question({kFront}), context);
  EXPECT_EQ(answer.error.code(), core::StatusCode::kResourceExhausted);
  EXPECT_THAT(answer.error.message(), HasSubstr("fewer 'draws'"));
}

// 1.9 million pixels, of which the mug covers some 1300; they are reduced to 19 200 at most.
TEST(NextView, ALongNarrowImageIsReducedByItsArea) {
  CandidateView narrow = kFront;
  narrow.intrinsics = geometry::PinholeCamera{119, 16384, 200.0, 200.0, 59.0, 8191.5};
  const NextViewAnswer answer = asked(two_turns(), {narrow});
  EXPECT_GT(answer.views[0].visible_pixels, 2);
  EXPECT_LT(answer.views[0].visible_pixels, 40);
}

TEST(NextView, IsStoppedOnRequest) {
  core::Cancellation cancellation;
  cancellation.request();
  QueryContext context;
  context.cancellation = &cancellation;
  EXPECT_EQ(answer_to(two_turns(), question({kFront}), context).error.code(), core::StatusCode::kCancelled);
}

TEST(NextView, WhereAllIsToldTheOrderIsSaidToMeanNothing) {
  belief::Belief belief = two_turns();
  belief.objects[0].particles[1].X_WO.translation.y() = 0.15;
  const NextViewAnswer answer = asked(belief, {kFront, kBack});
  EXPECT_FALSE(answer.best_is_clear);
  EXPECT_THAT(answer.remarks, testing::Contains(HasSubstr("their order means nothing")));
}

TEST(NextView, ThreadsDoNotChangeTheAnswer) {
  const belief::Belief belief = two_turns(0.4, 0.004);
  EXPECT_EQ(asked(belief, {kFront, kBack}, ViewAbout::kPose, 1), asked(belief, {kFront, kBack}, ViewAbout::kPose, 3));
}

}  // namespace
}  // namespace prescene::queries::next_view_laws_test
