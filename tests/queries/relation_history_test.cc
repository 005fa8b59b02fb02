// SPDX-License-Identifier: Apache-2.0
// When relations held: changes only, without noise, within bounds.
#include "prescene/queries/relation_history.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/queries/sliding_scene.h"

namespace prescene::queries::relation_history_test {
namespace {

using belief::ObservedInterval;
using belief::RelationKind;
using belief::RelationProbability;
using testing::HasSubstr;

constexpr core::TimeNs kFrame = 100'000'000;

RelationProbability touches(double probability) { return {RelationKind::kTouches, "a", "b", probability, 0.0, 1.0}; }

/// Probabilities of a touch in frames 1, 2, ...
RelationHistory history_of(const std::vector<double>& probabilities, const HistoryOptions& options = {}) {
  RelationHistory history(options);
  core::TimeNs stamp = 0;
  for (const double probability : probabilities) history.add(stamp += kFrame, {touches(probability)});
  return history;
}

TEST(RelationHistory, AnIntervalIsFromTheFrameThatHasItToTheFirstThatHasNot) {
  const auto timeline = history_of({0.0, 0.9, 1.0, 0.1, 0.0, 0.8}).timeline();
  ASSERT_EQ(timeline->intervals.size(), 2u);
  EXPECT_EQ(timeline->intervals[0],
            (ObservedInterval{RelationKind::kTouches, "a", "b", 2 * kFrame, 4 * kFrame, false, false, 0.95, 2}));
  EXPECT_EQ(timeline->intervals[1],
            (ObservedInterval{RelationKind::kTouches, "a", "b", 6 * kFrame, 6 * kFrame, true, false, 0.8, 1}));
  EXPECT_EQ(timeline->frames, 6u);
}

TEST(RelationHistory, NoiseAboutOneHalfMakesNoIntervals) {
  EXPECT_TRUE(history_of({0.0, 0.55, 0.45, 0.59, 0.41}).timeline()->intervals.empty());
  const auto timeline = history_of({0.0, 0.7, 0.45, 0.55, 0.45, 0.7}).timeline();
  ASSERT_EQ(timeline->intervals.size(), 1u);
  EXPECT_EQ(timeline->intervals[0].frames, 5);
}

TEST(RelationHistory, WhatHeldInTheFirstFrameBeganBefore) {
  EXPECT_TRUE(history_of({1.0, 1.0}).timeline()->intervals.at(0).began_before);
}

TEST(RelationHistory, OldIntervalsAreForgottenAndTheirNumberIsBounded) {
  std::vector<double> flicker;
  for (int i = 0; i < 400; ++i) flicker.push_back(i % 2);
  const auto of_two_seconds = history_of(flicker, {.seconds = 2.0}).timeline();
  for (const ObservedInterval& interval : of_two_seconds->intervals)
    EXPECT_GE(interval.end_ns, of_two_seconds->from_ns);
  EXPECT_EQ(of_two_seconds->from_ns, 400 * kFrame - core::ns_of(2.0));
  EXPECT_EQ(of_two_seconds->forgotten, 0u);
  const auto of_five = history_of(flicker, {.seconds = 1e6, .most_intervals = 5}).timeline();
  EXPECT_EQ(of_five->intervals.size(), 5u);
  EXPECT_EQ(of_five->forgotten, 195u);
  RelationHistory many({.seconds = 1e6, .most_intervals = 7});
  std::vector<RelationProbability> all;
  for (int i = 0; i < 50; ++i) all.push_back({RelationKind::kMoves, "thing " + std::to_string(i), "", 1.0, 0.0, 1.0});
  for (int i = 1; i < 10; ++i) many.add(i * kFrame, all);
  EXPECT_EQ(many.timeline()->intervals.size(), 7u);
}

TEST(RelationHistory, AClockThatGoesBackBeginsAnew) {
  RelationHistory history = history_of({0.0, 1.0, 1.0});
  history.add(kFrame, {touches(1.0)});
  const auto timeline = history.timeline();
  EXPECT_EQ(timeline->frames, 1u);
  ASSERT_EQ(timeline->intervals.size(), 1u);
  EXPECT_TRUE(timeline->intervals[0].began_before);
}

TEST(RelationHistory, WhatComesToBePresentAppearsBetweenTwoFrames) {
  RelationHistory history({});
  const RelationProbability present{RelationKind::kPresent, "mug", "", 0.9, 0.0, 1.0};
  history.add(1 * kFrame, {});
  history.add(2 * kFrame, {present});
  history.add(3 * kFrame, {});
  const auto timeline = history.timeline();
  const auto of = [&](RelationKind kind) {
    for (const ObservedInterval& interval : timeline->intervals)
      if (interval.relation == kind) return std::pair(interval.begin_ns, interval.end_ns);
    return std::pair<core::TimeNs, core::TimeNs>(0, 0);
  };
  EXPECT_EQ(of(RelationKind::kAppears), std::pair(1 * kFrame, 2 * kFrame));
  EXPECT_EQ(of(RelationKind::kPresent), std::pair(2 * kFrame, 3 * kFrame));
  EXPECT_EQ(of(RelationKind::kDisappears), std::pair(2 * kFrame, 3 * kFrame));
}

TEST(RelationHistory, QuestionsAboutThePastAreAnsweredFromTheContext) {
  core::ThreadPool pool(1);
  QueryContext context = tests::context_with(tests::slide, pool);
  const belief::Belief belief = tests::two_hypotheses();
  belief::TimelineQuery query;
  EXPECT_EQ(queries::answer(belief, {"", query}, context).error.code(), core::StatusCode::kUnavailable);

  const RelationHistory history = history_of({0.0, 0.9, 0.0});
  context.timeline = [&] { return history.timeline(); };
  query.first = belief::IntervalPattern{RelationKind::kTouches, "cartn", ""};
  EXPECT_THAT(queries::answer(belief, {"", query}, context).error.message(), HasSubstr("did you mean 'carton'?"));
  query.first->subject = "b";
  const belief::Answer answer = queries::answer(belief, {"", query}, context);
  ASSERT_TRUE(answer.error.ok()) << answer.error.message();
  EXPECT_EQ(std::get<belief::TimelineAnswer>(answer.what).timeline.intervals.size(), 1u) << "touches goes both ways";
}

}  // namespace
}  // namespace prescene::queries::relation_history_test
