// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/evaluate/explained_events.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "prescene/service/load_scene.h"
#include "tests/support/paths.h"

namespace prescene::service {
namespace {

class EventEpisodes : public testing::TestWithParam<std::string> {};

TEST_P(EventEpisodes, AreValidAndKnowOnlyWhatTheyAreTold) {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const EventEpisode made = make_event_episode(GetParam(), seed);
    std::string warnings;
    const core::LogSink log = [&](core::LogLevel, const std::string& text) { warnings += text + "\n"; };
    const auto world = load_scene_text(made.world, "world.yaml", log);
    ASSERT_TRUE(world.ok()) << world.status().message();
    const auto known = load_scene_text(made.known, "known.yaml", log);
    ASSERT_TRUE(known.ok()) << known.status().message();
    EXPECT_EQ(warnings, "") << made.world;
    EXPECT_TRUE((*known)->actions.empty() || made.reports_robot);
    EXPECT_EQ(made.truth == belief::EventKind::kNothing, made.object.empty());
    if (made.object.empty()) continue;
    EXPECT_TRUE(belief::find_object(**known, made.object));
    EXPECT_GT(made.time, made.from);
    EXPECT_LT(made.time, made.to - 0.5);
  }
}

TEST_P(EventEpisodes, DifferFromSeedToSeedAndAreTheSameForOne) {
  EXPECT_EQ(make_event_episode(GetParam(), 7).world, make_event_episode(GetParam(), 7).world);
  EXPECT_NE(make_event_episode(GetParam(), 7).world, make_event_episode(GetParam(), 8).world);
}

INSTANTIATE_TEST_SUITE_P(Kinds, EventEpisodes, testing::ValuesIn(event_episode_kinds()),
                         [](const auto& tested) { return tested.param; });

class ExplainedEpisodes : public testing::TestWithParam<std::string> {};

TEST_P(ExplainedEpisodes, NameTheEventAndItsTime) {
  ExplainedEventsOptions options;
  const EpisodeResult result = explain_episode(make_event_episode(GetParam(), 1), 1, options, testing::TempDir(), {});
  EXPECT_EQ(result.failure, "");
  // Of one episode, the second answer may be the right one, if it is not ruled out.
  EXPECT_TRUE(result.nearly_right || result.of_truth > 0.1)
      << result.first << " " << result.probability << ", truth " << result.of_truth;
  // Negative: there is none.
  EXPECT_LT(result.time_error, 0.3);
  EXPECT_LT(result.direction_error, 0.6);
}

INSTANTIATE_TEST_SUITE_P(Kinds, ExplainedEpisodes,
                         testing::Values("nothing", "pushed", "pushed_over", "bumped", "slipped", "moved", "taken_away",
                                         "exchanged"),
                         [](const auto& tested) { return tested.param; });

EpisodeResult said(const std::string& kind, double probability, bool right) {
  EpisodeResult result;
  result.kind = kind;
  result.probability = probability;
  result.right = result.nearly_right = right;
  return result;
}

TEST(ExplainedEvents, CalibrationErrorIsTheMeanGapOfItsBins) {
  ExplainedEventsReport report;
  // Two bins: stated 0.95 and 3 of 4 right; stated 0.55 and 1 of 2 right.
  for (const bool right : {true, true, true, false}) report.episodes.push_back(said("pushed", 0.95, right));
  for (const bool right : {true, false}) report.episodes.push_back(said("bumped", 0.55, right));
  EXPECT_NEAR(expected_calibration_error(report), (4 * 0.2 + 2 * 0.05) / 6.0, 1e-12);
  EXPECT_EQ(to_json(report)["kinds"].back()["right"], 4);
  EXPECT_EQ(table_of(report).back()[1], "6");
}

TEST(ExplainedEvents, RefusesUnknownKinds) {
  core::ThreadPool pool(1);
  ExplainedEventsOptions options;
  options.kinds = {"abducted"};
  EXPECT_EQ(evaluate_explained_events(options, 1, pool, {}).status().code(), core::StatusCode::kInvalidInput);
}

}  // namespace
}  // namespace prescene::service
