// SPDX-License-Identifier: Apache-2.0
// Answers to whether an object stays where it is.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <optional>
#include <string>

#include "ending_otherwise.h"
#include "prescene/queries/query_engine.h"
#include "sliding_scene.h"

namespace prescene::queries::stability_test {
namespace {

using belief::Answer;
using belief::StabilityAnswer;
using belief::StabilityQuery;
using testing::HasSubstr;
using tests::blowing_up;
using tests::context_ending;
using tests::context_with;
using tests::slide;
using tests::two_hypotheses;

StabilityQuery stability_of(const std::string& object) {
  StabilityQuery query;
  query.object = object;
  return query;
}

TEST(Stability, IsTheShareOfInstancesThatStay) {
  core::ThreadPool pool(1);
  const Answer answer = queries::answer(two_hypotheses(), {"", stability_of("carton")}, context_with(slide, pool));
  ASSERT_TRUE(answer.error.ok()) << answer.error.message();
  const auto& told = std::get<StabilityAnswer>(answer.what);
  EXPECT_EQ(told.stable.name, "stable");
  EXPECT_NEAR(told.stable.probability, 0.75, 1e-12);
  EXPECT_LE(told.stable.low, 0.75);
  EXPECT_GE(told.stable.high, 0.75);
  EXPECT_EQ(told.likely_event, "slides");
}

TEST(Stability, MovingThereAndBackIsNotStable) {
  core::ThreadPool pool(1);
  // Instances move in a straight line, so "there and back" is a start with a velocity that the samples show: here a
  // turn beyond the limit at the end alone.
  const auto turn = [](const belief::WorldState& start, const simulation::RunRequest&, core::RandomStream) {
    belief::WorldState end = start;
    end.objects[1].X_WO.rotation = geometry::exp_rotation({0.0, 0.0, 0.2});
    return end;
  };
  const Answer answer = queries::answer(two_hypotheses(), {"", stability_of("cup")}, context_with(turn, pool));
  const auto& told = std::get<StabilityAnswer>(answer.what);
  EXPECT_EQ(told.stable.probability, 0.0);
  EXPECT_EQ(told.likely_event, "turns");
  StabilityQuery lenient = stability_of("cup");
  lenient.max_turn = 0.3;
  const Answer calm = queries::answer(two_hypotheses(), {"", lenient}, context_with(turn, pool));
  EXPECT_EQ(std::get<StabilityAnswer>(calm.what).stable.probability, 1.0);
  EXPECT_EQ(std::get<StabilityAnswer>(calm.what).likely_event, "");
}

TEST(Stability, AHeldObjectIsLetGo) {
  core::ThreadPool pool(1);
  std::atomic<int> released{0};
  geometry::Vector3d retreat = geometry::Vector3d::Zero();
  const QueryContext context = context_with(
      [&](const belief::WorldState& start, const simulation::RunRequest& request, core::RandomStream) {
        if (request.actions.size() == 1) {
          const auto& release = std::get<belief::Release>(request.actions[0].what);
          if (release.object == "carton" && request.actions[0].time == 0.0) ++released;
          retreat = release.retreat;
        }
        return start;
      },
      pool);
  belief::Belief belief = two_hypotheses();
  for (belief::Particle& particle : belief.objects[0].particles) particle.mode = belief::MotionMode::kHeld;
  const Answer answer = queries::answer(belief, {"", stability_of("carton")}, context);
  ASSERT_TRUE(answer.error.ok()) << answer.error.message();
  EXPECT_EQ(released, std::get<StabilityAnswer>(answer.what).instances);
  // Straight away from the carton.
  EXPECT_GT(retreat.normalized().dot(geometry::Vector3d(0.2 - 0.12, 0.0, 0.3 - 0.1).normalized()), 0.999);
}

TEST(Stability, InstancesThatFailedAreToldAndWidenItsInterval) {
  core::ThreadPool pool(1);
  const Answer answer =
      queries::answer(two_hypotheses(), {"", stability_of("carton")}, context_ending(blowing_up(true, false), pool));
  ASSERT_TRUE(answer.error.ok()) << answer.error.message();
  const auto& told = std::get<StabilityAnswer>(answer.what);
  EXPECT_NEAR(told.stable.probability, 0.75, 1e-12);
  EXPECT_GE(told.stable.high, 1.0 - 1e-12) << "those that failed may all have stayed";
  EXPECT_GT(told.failed_instances, 0);
  EXPECT_LT(told.failed_instances, told.instances);
  EXPECT_FALSE(told.converged);
  EXPECT_EQ(told.stopped, "max_instances");
  EXPECT_EQ(told.likely_event, "") << "none moved";
  ASSERT_EQ(told.remarks.size(), 2u);
  EXPECT_THAT(told.remarks[0], HasSubstr("failed in the simulator"));
  EXPECT_THAT(told.remarks[1], HasSubstr("Not every interval"));
}

TEST(Stability, OfInstancesThatAllFailedIsAnError) {
  core::ThreadPool pool(1);
  const Answer answer =
      queries::answer(two_hypotheses(), {"", stability_of("carton")}, context_ending(blowing_up(true, true), pool));
  EXPECT_THAT(answer.error.message(), HasSubstr("every instance failed in the simulator"));
}

TEST(Stability, AnEventThatWasNotWorkedOutInTimeIsNamedInTheRemarks) {
  core::ThreadPool pool(1);
  // What is told has states farther apart than what is judged.
  const auto stopped = [](const belief::WorldState&, const simulation::RunRequest& request) {
    return request.sample_interval > 0.03 ? std::optional(belief::TrajectoryEnd::kCancelled) : std::nullopt;
  };
  const Answer answer = queries::answer(two_hypotheses(), {"", stability_of("carton")}, context_ending(stopped, pool));
  const auto& told = std::get<StabilityAnswer>(answer.what);
  EXPECT_NEAR(told.stable.probability, 0.75, 1e-12);
  EXPECT_EQ(told.likely_event, "");
  ASSERT_FALSE(told.remarks.empty());
  EXPECT_THAT(told.remarks.back(), HasSubstr("likely_event"));
}

TEST(Stability, OfAnObjectThatIsNotThereIsAnError) {
  core::ThreadPool pool(1);
  belief::Belief belief = two_hypotheses();
  belief.objects[0].state = belief::TrackState::kLost;
  const Answer answer = queries::answer(belief, {"", stability_of("carton")}, context_with(slide, pool));
  EXPECT_THAT(answer.error.message(), HasSubstr("'carton'"));
}

}  // namespace
}  // namespace prescene::queries::stability_test
