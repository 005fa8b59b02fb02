// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "ending_otherwise.h"
#include "prescene/queries/query_engine.h"
#include "prescene/rendering/reference/reference_renderer.h"
#include "sliding_scene.h"

namespace prescene::queries {
namespace {

using belief::Answer;
using belief::ViewAnswer;
using belief::ViewQuery;
using geometry::Pose;
using testing::HasSubstr;
using tests::blowing_up;
using tests::context_ending;
using tests::context_with;
using tests::slide;
using tests::sliding_scene;
using tests::two_hypotheses;

TEST(View, ShowsTheLikeliestAndWhereObjectsMayBe) {
  core::ThreadPool pool(2);
  QueryContext context = context_with(slide, pool);
  context.make_renderer = []() -> core::Result<std::unique_ptr<rendering::Renderer>> {
    return rendering::make_reference_renderer();
  };
  belief::Belief belief = two_hypotheses();
  const Answer answer = queries::answer(belief, {"", ViewQuery{}}, context);
  ASSERT_TRUE(answer.error.ok()) << answer.error.message();
  const auto& seen = std::get<ViewAnswer>(answer.what);
  ASSERT_EQ(seen.label_names, (std::vector<std::string>{"carton", "cup", "table", "hand"}));
  const geometry::PinholeCamera& camera = belief.scene->camera->intrinsics;
  const auto pixel = [&](double x, double y, double z) {
    const Eigen::Vector2d p = camera.project(belief.X_WC.inverse() * geometry::Vector3d(x, y, z));
    return std::pair<int, int>(static_cast<int>(std::lround(p.x())), static_cast<int>(std::lround(p.y())));
  };
  // The heavier hypothesis stays; top of the carton at z = 0.2, that of the cup at 0.05.
  const auto [cx, cy] = pixel(0.12, 0.0, 0.2);
  EXPECT_EQ(seen.labels(cx, cy), 1);
  EXPECT_NEAR(seen.depth(cx, cy), 1.3, 1e-3);
  EXPECT_NEAR(seen.presence(cx, cy), 0.75, 1e-5);
  const auto [ux, uy] = pixel(0.3, 0.3, 0.05);
  EXPECT_EQ(seen.labels(ux, uy), 2);
  EXPECT_NEAR(seen.presence(ux, uy), 1.0, 1e-5);
  // Slid out of the view at x = 1.1; the table is no object, and nor is the hand.
  const auto [tx, ty] = pixel(-0.5, -0.4, 0.0);
  EXPECT_EQ(seen.labels(tx, ty), 3);
  EXPECT_EQ(seen.presence(tx, ty), 0.0f);
  const auto [hx, hy] = pixel(0.2, 0.0, 0.3);
  EXPECT_EQ(seen.labels(hx, hy), 4);
}

TEST(View, StatesThatFailedAreNotDrawn) {
  core::ThreadPool pool(1);
  const belief::Belief belief = two_hypotheses();
  const Answer answer = queries::answer(belief, {"", ViewQuery{}}, context_ending(blowing_up(true, false), pool));
  ASSERT_TRUE(answer.error.ok()) << answer.error.message();
  const auto& seen = std::get<ViewAnswer>(answer.what);
  EXPECT_GT(seen.failed_instances, 0);
  ASSERT_EQ(seen.remarks.size(), 1u);
  EXPECT_THAT(seen.remarks[0], HasSubstr("failed in the simulator"));
  const Eigen::Vector2d p =
      belief.scene->camera->intrinsics.project(belief.X_WC.inverse() * geometry::Vector3d(0.12, 0.0, 0.2));
  EXPECT_NEAR(seen.presence(static_cast<int>(std::lround(p.x())), static_cast<int>(std::lround(p.y()))), 1.0, 1e-5);
}

TEST(View, WhoseLikeliestStateFailedIsAnError) {
  core::ThreadPool pool(1);
  const auto error_of = [&](bool slippery) {
    return queries::answer(two_hypotheses(), {"", ViewQuery{}}, context_ending(blowing_up(slippery, true), pool))
        .error.message();
  };
  EXPECT_THAT(error_of(false), HasSubstr("the likeliest start failed in the simulator"));
  EXPECT_THAT(error_of(true), HasSubstr("every instance failed in the simulator"));
}

TEST(View, OfNowNeedsNoSimulator) {
  core::ThreadPool pool(1);
  QueryContext context;
  context.pool = &pool;
  context.make_renderer = []() -> core::Result<std::unique_ptr<rendering::Renderer>> {
    return rendering::make_reference_renderer();
  };
  ViewQuery now;
  now.time = 0.0;
  const belief::Belief belief = two_hypotheses();
  const Answer answer = queries::answer(belief, {"", now}, context);
  ASSERT_TRUE(answer.error.ok()) << answer.error.message();
  const auto& seen = std::get<ViewAnswer>(answer.what);
  const Eigen::Vector2d p =
      belief.scene->camera->intrinsics.project(belief.X_WC.inverse() * geometry::Vector3d(0.11, 0.0, 0.2));
  // Both hypotheses cover it.
  EXPECT_NEAR(seen.presence(static_cast<int>(std::lround(p.x())), static_cast<int>(std::lround(p.y()))), 1.0, 1e-5);
}

/// The view of now from any pose, with all that it can have.
ViewAnswer detailed_view(const belief::Belief& belief, const ViewQuery& asked) {
  core::ThreadPool pool(1);
  QueryContext context;
  context.pool = &pool;
  context.make_renderer = []() -> core::Result<std::unique_ptr<rendering::Renderer>> {
    return rendering::make_reference_renderer();
  };
  ViewQuery query = asked;
  query.time = 0.0;
  query.detail = {true, true, true};
  const Answer answer = queries::answer(belief, {"", query}, context);
  EXPECT_TRUE(answer.error.ok()) << answer.error.message();
  return answer.error.ok() ? std::get<ViewAnswer>(answer.what) : ViewAnswer{};
}

// Two poses of the carton, of weights 1/4 and 3/4, whose tops are 0.02 m apart in height: the deviation of the choice
// is 0.02 sqrt(3/16).
TEST(View, HasMeanAndDeviationOfTheDepthFromAnyPose) {
  belief::Belief belief = two_hypotheses();
  for (belief::Particle& particle : belief.objects[0].particles) particle.covariance.setZero();
  belief.objects[0].particles[0].X_WO = Pose::from_translation({0.0, 0.0, 0.12});
  belief.objects[0].particles[1].X_WO = Pose::from_translation({0.0, 0.0, 0.1});
  belief.robot = {Pose::from_translation({0.9, 0.9, 0.9})};
  ViewQuery query;
  query.X_WC = Pose{geometry::Quaterniond(0.0, 1.0, 0.0, 0.0), {0.0, 0.0, 1.0}};
  query.intrinsics = geometry::PinholeCamera{41, 31, 40.0, 40.0, 20.0, 15.0};
  const ViewAnswer seen = detailed_view(belief, query);
  ASSERT_TRUE(seen.mean_depth && seen.depth_deviation);
  ASSERT_EQ(seen.mean_depth->width(), 41);
  EXPECT_NEAR((*seen.mean_depth)(20, 15), 0.25 * 0.78 + 0.75 * 0.8, 1e-5);
  EXPECT_NEAR((*seen.depth_deviation)(20, 15), 0.02 * std::sqrt(3.0 / 16.0), 1e-5);
  EXPECT_NEAR(seen.depth(20, 15), 0.8, 1e-5);
  // The table beside it is known exactly.
  EXPECT_NEAR((*seen.mean_depth)(38, 2), 1.0, 1e-5);
  EXPECT_NEAR((*seen.depth_deviation)(38, 2), 0.0, 1e-6);
  ASSERT_EQ(seen.objects.size(), 2u);
  EXPECT_EQ(seen.objects[0].object, "carton");
  EXPECT_NEAR(seen.objects[0].probability(20, 15), 1.0, 1e-5);
  EXPECT_EQ(seen.objects[1].probability(20, 15), 0.0f);
}

// A hand goes where the object that it holds is taken, and it holds it where it is: 8 cm in front of the hand in the
// likelier state and 10 cm in the other. The thing ends at x = -0.3, so that the hand ends at -0.22 or at -0.2, and not
// between them where the mean of both would have it.
TEST(View, AHandIsWhereItsObjectIsTakenInEachState) {
  belief::Belief belief = two_hypotheses();
  for (belief::Particle& particle : belief.objects[0].particles) {
    particle.covariance.setZero();
    particle.mode = belief::MotionMode::kHeld;
  }
  belief::Transport transport;
  transport.object = "carton";
  transport.X_WO = belief::FixedPose{Pose::from_translation({-0.3, 0.3, 0.1})};
  transport.duration = 0.5;
  ViewQuery query;
  query.time = 1.0;
  query.actions = {{0.0, transport}};
  query.detail.spread = true;
  query.X_WC = Pose{geometry::Quaterniond(0.0, 1.0, 0.0, 0.0), {-0.22, 0.3, 1.0}};
  query.intrinsics = geometry::PinholeCamera{101, 101, 700.0, 700.0, 50.0, 50.0};
  core::ThreadPool pool(1);
  QueryContext context = context_with(slide, pool);
  context.make_renderer = []() -> core::Result<std::unique_ptr<rendering::Renderer>> {
    return rendering::make_reference_renderer();
  };
  const Answer answer = queries::answer(belief, {"", query}, context);
  ASSERT_TRUE(answer.error.ok()) << answer.error.message();
  const auto& seen = std::get<ViewAnswer>(answer.what);
  double pixels = 0.0, sum_x = 0.0;
  for (int y = 0; y < 101; ++y)
    for (int x = 0; x < 101; ++x)
      if (const std::uint16_t label = seen.labels(x, y); label != 0 && seen.label_names[label - 1U] == "hand") {
        pixels += 1.0;
        sum_x += x;
      }
  ASSERT_GT(pixels, 500.0);
  EXPECT_NEAR(sum_x / pixels, 50.0, 0.5);
  EXPECT_NEAR(seen.depth(50, 50), 0.68, 1e-3);  // the top of the ball of 2 cm
  // 2.5 cm to the side the ball of the other state is alone.
  EXPECT_NEAR((*seen.mean_depth)(75, 50), 0.25 * 0.68 + 0.75 * 1.0, 2e-3);
}

// Of 64 states, each without the object with probability 0.4: four standard errors are 0.25.
TEST(View, AnObjectThatMayNotBeThereIsInAShareOfTheStates) {
  belief::Belief belief = two_hypotheses();
  belief.objects[0].existence = 0.6;
  for (belief::Particle& particle : belief.objects[0].particles) {
    particle.covariance.setZero();
    particle.X_WO = Pose::from_translation({0.0, 0.0, 0.1});
  }
  const ViewAnswer seen = detailed_view(belief, {});
  const Eigen::Vector2d p =
      belief.scene->camera->intrinsics.project(belief.X_WC.inverse() * geometry::Vector3d(0, 0, 0.2));
  const int x = static_cast<int>(std::lround(p.x())), y = static_cast<int>(std::lround(p.y()));
  EXPECT_NEAR(seen.objects[0].probability(x, y), 0.6, 0.25);
  EXPECT_EQ(seen.objects[0].probability(x, y), seen.presence(x, y));
  EXPECT_EQ(seen.objects[0].existence, 0.6);
}

TEST(View, ColourIsThatOfModelsThatHaveOneAndElseAbsent) {
  belief::Belief belief = two_hypotheses();
  const ViewAnswer without = detailed_view(belief, {});
  EXPECT_FALSE(without.color.has_value());
  EXPECT_THAT(without.remarks, testing::Contains(HasSubstr("No colour is known")));
  auto scene = std::make_shared<belief::Scene>(*belief.scene);
  scene->models[1].color = {1.0, 0.0, 0.0};
  belief.scene = scene;
  const ViewAnswer with = detailed_view(belief, {});
  ASSERT_TRUE(with.color.has_value());
  ASSERT_EQ(with.color_sources.size(), 4u);
  EXPECT_EQ(with.color_sources[0].from, "");
  EXPECT_EQ(with.color_sources[1].from, "model");
  const Eigen::Vector2d p =
      belief.scene->camera->intrinsics.project(belief.X_WC.inverse() * geometry::Vector3d(0.3, 0.3, 0.05));
  const geometry::Rgb cup = (*with.color)(static_cast<int>(std::lround(p.x())), static_cast<int>(std::lround(p.y())));
  EXPECT_GT(cup[0], 100);
  EXPECT_EQ(cup[1], 0);
  EXPECT_EQ((*with.color)(0, 0), (geometry::Rgb{0, 0, 0})) << "the table's colour is not known";
}

TEST(View, ImagesThatAnAnswerCannotHoldAreRefusedBeforeAnyWork) {
  core::ThreadPool pool(1);
  QueryContext context = context_with(slide, pool);
  context.make_renderer = []() -> core::Result<std::unique_ptr<rendering::Renderer>> {
    return core::unavailable("never asked");
  };
  ViewQuery query;
  query.intrinsics = geometry::PinholeCamera{2048, 2048, 1000.0, 1000.0, 1023.5, 1023.5};
  const Answer answer = queries::answer(two_hypotheses(), {"", query}, context);
  EXPECT_EQ(answer.error.code(), core::StatusCode::kResourceExhausted);
  EXPECT_THAT(answer.error.message(), HasSubstr("smaller 'intrinsics'"));
}

TEST(View, NeedsACamera) {
  core::ThreadPool pool(1);
  auto scene = sliding_scene();
  scene->camera.reset();
  EXPECT_THAT(queries::answer(scene, 1, {"", ViewQuery{}}, context_with(slide, pool)).error.message(),
              HasSubstr("no camera"));
  EXPECT_THAT(queries::answer(sliding_scene(), 1, {"", ViewQuery{}}, context_with(slide, pool)).error.message(),
              HasSubstr("no renderer"));
}

}  // namespace
}  // namespace prescene::queries
