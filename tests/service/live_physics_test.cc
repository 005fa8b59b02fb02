// SPDX-License-Identifier: Apache-2.0
// The promise where users meet it: however many frames were seen in which nothing happened, the live belief answers as
// the scene's priors do; and what motion tells is in the answers.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "prescene/belief/json.h"
#include "prescene/queries/query_engine.h"
#include "prescene/service/recording/replay.h"
#include "prescene/service/tracking/tracker.h"
#include "tests/service/recorded_box.h"
#include "tests/support/paths.h"

namespace prescene::service::live_physics_test {
namespace {

/// A box that a hand holds just above a slope of 20 degrees; its friction is uniform in (0.1, 0.9), the slope's is 1.
/// Let go, it slides where the friction is below tan 20 degrees = 0.364: with probability 0.33.
std::string slope_scene(double duration) {
  return "name: slope\nduration: " + std::to_string(duration) + R"(
models:
  box: {box: [0.1, 0.08, 0.06], mass: 0.4, friction: {uniform: [0.1, 0.9]}}
supports:
  slope: {box: [1.2, 0.8, 0.04], pose: {position: [-0.0068404, 0, -0.018793852], rotation: {axis_angle_deg: [0, 1, 0, 20]}}, friction: 1.0}
robot:
  hand: {box: [0.02, 0.02, 0.1], timeline: [{time: 0, position: [0.0345, 0, 0.125]}]}
objects:
  box:
    model: box
    pose: {position: [0.0104, 0, 0.0286], rotation: {axis_angle_deg: [0, 1, 0, 20]}}
    held_by: hand
camera:
  width: 160
  height: 120
  fov_deg: 55
  look: {from: [0.55, -0.5, 0.5], at: [0, 0, 0.03]}
)";
}

/// A pusher that strikes a box on a table at 0.6 m/s and stops after 12 cm; the box slides on.
std::string push_scene(const std::string& friction) {
  return R"(name: push
duration: 2.4
models:
  box: {box: [0.1, 0.08, 0.06], mass: 0.4, friction: )" +
         friction + R"(}
supports:
  table: {box: [1.2, 0.8, 0.04], pose: {position: [0.1, 0, -0.02]}, friction: 1.0}
robot:
  pusher:
    box: [0.02, 0.06, 0.04]
    timeline: [{time: 0, position: [-0.11, 0, 0.03]}, {time: 0.8, position: [-0.11, 0, 0.03]}, {time: 1.0, position: [0.01, 0, 0.03]}]
objects:
  box: {model: box, pose: {position: [0, 0, 0.03]}}
camera:
  width: 320
  height: 240
  fov_deg: 55
  look: {from: [0.55, -0.5, 0.5], at: [0.1, 0, 0.03]}
)";
}

constexpr const char* kLetGo = R"({"predict": {"duration": 1.5,
  "actions": [{"time": 0, "release": {"object": "box", "retreat": [0, 0, 0.2]}}],
  "outcomes": {"slides": {"object": "box", "moved_more_than": 0.05}}}})";

class LivePhysics : public ::testing::Test {
 protected:
  belief::OutcomeProbability ask(const std::shared_ptr<const belief::Belief>& belief, const char* question) {
    const auto query = belief::query_from_json(question);
    EXPECT_TRUE(query.ok()) << query.status().message();
    const belief::Answer answer = queries::answer(*belief, *query, backends_.query_context(pool_));
    EXPECT_TRUE(answer.error.ok()) << answer.error.message();
    return std::get<belief::PredictAnswer>(answer.what).outcomes.at(0);
  }
  belief::OutcomeProbability ask(const std::shared_ptr<const belief::Scene>& scene, const char* question) {
    const auto query = belief::query_from_json(question);
    const belief::Answer answer = queries::answer(scene, 1, *query, backends_.query_context(pool_));
    EXPECT_TRUE(answer.error.ok()) << answer.error.message();
    return std::get<belief::PredictAnswer>(answer.what).outcomes.at(0);
  }
  /// What is believed at the end of what a camera saw of `world`, by who knows it as `yaml`.
  std::shared_ptr<const belief::Belief> tracked(const std::string& world, const std::string& yaml, std::uint64_t seed) {
    const std::filesystem::path path = folder_.path() / ("run" + std::to_string(++runs_) + ".mcap");
    const core::Status recorded = tests::record_scene(world, {"scene.yaml", world, 1, ""}, 30.0, path);
    EXPECT_TRUE(recorded.ok()) << recorded.message();
    const auto scene = load_scene_text(yaml, "scene.yaml", {});
    EXPECT_TRUE(scene.ok()) << scene.status().message();
    const auto tracker = Tracker::create(*scene, {}, seed, backends_);
    EXPECT_TRUE(tracker.ok()) << tracker.status().message();
    const auto summary = replay_recording(path, {}, **tracker, {}, {}, {}, {});
    EXPECT_TRUE(summary.ok()) << summary.status().message();
    return (*tracker)->belief();
  }

  const tests::ScratchDir folder_;
  int runs_ = 0;
  core::ThreadPool pool_{2};
  Backends backends_{pool_};
};

TEST_F(LivePhysics, FramesThatSayNothingLeaveTheAnswerAtThePriors) {
  const auto scene = load_scene_text(slope_scene(1.0), "slope.yaml", {});
  ASSERT_TRUE(scene.ok()) << scene.status().message();
  const belief::OutcomeProbability prior = ask(*scene, kLetGo);
  const double truth = (std::tan(20.0 * M_PI / 180.0) - 0.1) / 0.8;
  EXPECT_LE(prior.low - 0.01, truth);
  EXPECT_GE(prior.high + 0.01, truth);
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const auto belief = tracked(slope_scene(1.0), slope_scene(1.0), seed);
    ASSERT_EQ(belief->objects[0].state, belief::TrackState::kTracked);
    EXPECT_EQ(belief->objects[0].physics, belief::PhysicalBelief{});
    const belief::OutcomeProbability live = ask(belief, kLetGo);
    std::printf("compared: slides, seed %d: live %.3f (%.3f to %.3f), priors %.3f, truth %.3f\n",
                static_cast<int>(seed), live.probability, live.low, live.high, prior.probability, truth);
    EXPECT_LE(live.low, prior.high) << seed;
    EXPECT_GE(live.high, prior.low) << seed;
  }
}

/// What lies still on a table does so in live answers, too, although its pose is known to some degrees only.
TEST_F(LivePhysics, WhatLiesStillStays) {
  const std::string yaml = tests::box_on_table("1.5");
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const auto belief = tracked(yaml, yaml, seed);
    const auto query = belief::query_from_json(R"({"stability": {"object": "box"}})");
    ASSERT_TRUE(query.ok()) << query.status().message();
    const belief::Answer answer = queries::answer(*belief, *query, backends_.query_context(pool_));
    ASSERT_TRUE(answer.error.ok()) << answer.error.message();
    const auto& stable = std::get<belief::StabilityAnswer>(answer.what).stable;
    const geometry::Vector6d deviation = belief::estimate(belief->objects[0]).covariance.diagonal().cwiseSqrt();
    std::printf(
        "compared: lies still, seed %d: stays with %.3f (%.3f to %.3f); deviations %.3f %.3f %.3f rad, %.4f %.4f %.4f "
        "m\n",
        static_cast<int>(seed), stable.probability, stable.low, stable.high, deviation[0], deviation[1], deviation[2],
        deviation[3], deviation[4], deviation[5]);
    EXPECT_GT(stable.probability, 0.97) << seed;
  }
}

TEST_F(LivePhysics, APushThatWasSeenTellsFriction) {
  for (const double truth : {0.2, 0.45}) {
    const auto belief = tracked(push_scene(std::to_string(truth)), push_scene("{uniform: [0.1, 0.9]}"), 1);
    const belief::ObjectBelief& box = belief->objects[0];
    EXPECT_EQ(box.physics.lessons, 1);  // lying still on a table says nothing
    const auto friction = belief::parameter_estimates(belief->scene->models[0], box.physics).at(0);
    std::printf("compared: friction %.2f, learned %.3f +- %.3f (90 %%: %.3f to %.3f)\n", truth, friction.mean,
                friction.standard_deviation, friction.low, friction.high);
    EXPECT_EQ(friction.name, "friction");
    EXPECT_LT(friction.low, truth);
    EXPECT_GT(friction.high, truth);
    EXPECT_LT(friction.standard_deviation, 0.6 * 0.8 / std::sqrt(12.0));  // of the prior's
  }
}

/// What one session learned is what the next begins with.
TEST_F(LivePhysics, WhatWasLearnedIsWhatTheNextSessionBeginsWith) {
  const auto recorded = folder_.path() / "push.mcap";
  ASSERT_TRUE(tests::record_scene(push_scene("0.3"), {"scene.yaml", push_scene("0.3"), 1, ""}, 30.0, recorded).ok());
  const auto scene = load_scene_text(push_scene("{uniform: [0.1, 0.9]}"), "scene.yaml", {});
  ASSERT_TRUE(scene.ok()) << scene.status().message();
  TrackerSettings settings;
  const auto first = Tracker::create(*scene, settings, 1, backends_);
  ASSERT_TRUE(first.ok()) << first.status().message();
  settings.learned = interfaces::learned_yaml((*first)->learned());
  const auto again = Tracker::create(*scene, settings, 1, backends_);
  ASSERT_TRUE(again.ok()) << again.status().message();
  EXPECT_EQ(*(*again)->belief(), *(*first)->belief()) << "nothing was learned: the file leaves the priors";

  ASSERT_TRUE(replay_recording(recorded, {}, **first, {}, {}, {}, {}).ok());
  const belief::PhysicalBelief learned = (*first)->belief()->objects[0].physics;
  ASSERT_EQ(learned.lessons, 1);
  settings.learned = interfaces::learned_yaml((*first)->learned());
  settings.learned_file = "learned.yaml";
  const auto next = Tracker::create(*scene, settings, 2, backends_);
  ASSERT_TRUE(next.ok()) << next.status().message();
  EXPECT_EQ((*next)->belief()->objects[0].physics, learned);
  EXPECT_EQ(interfaces::learned_yaml((*next)->learned()), settings.learned);

  const auto other = load_scene_text(push_scene("{uniform: [0.1, 0.8]}"), "scene.yaml", {});
  ASSERT_TRUE(other.ok());
  const auto refused = Tracker::create(*other, settings, 1, backends_);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.status().code(), core::StatusCode::kInvalidInput);
  EXPECT_NE(refused.status().message().find("learned.yaml:"), std::string::npos) << refused.status().message();
}

}  // namespace
}  // namespace prescene::service::live_physics_test
