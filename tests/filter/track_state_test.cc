// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/operators/track_state.h"

#include <gtest/gtest.h>

namespace prescene::filter_tests {
namespace {

using belief::TrackState;
using filter::WeightReport;

WeightReport seen(double nats) {
  WeightReport report;
  report.evidence_per_pixel = nats;
  report.visible_share = 0.8;
  report.visible_pixels = 40;
  return report;
}

constexpr core::TimeNs kFrameNs = 33'333'333;

TEST(TrackState, FollowsTheEvidence) {
  belief::ObjectBelief object;
  const filter::TrackStateOptions options;
  filter::update_track(seen(5.0), kFrameNs, options, object);
  EXPECT_EQ(object.state, TrackState::kTracked);
  EXPECT_EQ(object.last_seen_ns, kFrameNs);
  filter::update_track(seen(2.0), 2 * kFrameNs, options, object);
  EXPECT_EQ(object.state, TrackState::kDoubtful);
  EXPECT_EQ(object.frames_unseen, 1);
  EXPECT_EQ(object.last_seen_ns, kFrameNs);
  filter::update_track(seen(5.0), 3 * kFrameNs, options, object);
  EXPECT_EQ(object.frames_unseen, 0);
}

TEST(TrackState, AsksOfAPoseWhatItCanSay) {
  // Of a transparent thing 2 nats a pixel are expected: half of the usual limits' share of that is enough.
  belief::ObjectBelief object;
  WeightReport report = seen(1.2);
  report.expected_evidence = 2.0;
  filter::update_track(report, kFrameNs, {}, object);
  EXPECT_EQ(object.state, TrackState::kTracked);
  report.expected_evidence = 6.5;
  filter::update_track(report, 2 * kFrameNs, {}, object);
  EXPECT_EQ(object.state, TrackState::kDoubtful);
  EXPECT_EQ(filter::evidence_scale(6.5), 1.0);
  EXPECT_GT(filter::evidence_scale(0.0), 0.0);
  EXPECT_EQ(filter::evidence_scale(std::numeric_limits<double>::infinity()), 1.0);
}

TEST(TrackState, IsLostOnlyAfterSomeFramesOfContradiction) {
  belief::ObjectBelief object;
  const filter::TrackStateOptions options;
  for (int i = 1; i < options.lost_after_frames; ++i) {
    filter::update_track(seen(-1.0), i * kFrameNs, options, object);
    EXPECT_EQ(object.state, TrackState::kDoubtful) << i;
  }
  filter::update_track(seen(-1.0), options.lost_after_frames * kFrameNs, options, object);
  EXPECT_EQ(object.state, TrackState::kLost);
}

TEST(TrackState, HidingEndsTheContradiction) {
  belief::ObjectBelief object;
  const filter::TrackStateOptions options;
  WeightReport hidden;
  hidden.hidden_weight = 0.9;
  for (int i = 1; i < 40; ++i) {
    filter::update_track(i % options.lost_after_frames == 0 ? hidden : seen(-1.0), i * kFrameNs, options, object);
    EXPECT_NE(object.state, TrackState::kLost) << i;
  }
}

TEST(TrackState, AFewPixelsAreNotEnoughToBeSure) {
  belief::ObjectBelief object;
  const filter::TrackStateOptions options;
  WeightReport corner = seen(9.0);
  corner.visible_pixels = 4;
  filter::update_track(corner, kFrameNs, options, object);
  EXPECT_EQ(object.state, TrackState::kDoubtful);
  for (int i = 2; i < 20; ++i) filter::update_track(corner, i * kFrameNs, options, object);
  EXPECT_EQ(object.state, TrackState::kDoubtful);
  corner.visible_pixels = 5;
  filter::update_track(corner, 20 * kFrameNs, options, object);
  EXPECT_EQ(object.state, TrackState::kTracked);
}

TEST(TrackState, HiddenIsUnseenUntilItIsTooLong) {
  belief::ObjectBelief object;
  const filter::TrackStateOptions options;
  filter::update_track(seen(5.0), 0, options, object);
  const double existence = object.existence;
  WeightReport hidden;
  hidden.hidden_weight = 0.9;
  filter::update_track(hidden, static_cast<core::TimeNs>(59e9), options, object);
  EXPECT_EQ(object.state, TrackState::kUnseen);
  EXPECT_EQ(object.existence, existence);  // hidden says nothing
  filter::update_track(hidden, static_cast<core::TimeNs>(61e9), options, object);
  EXPECT_EQ(object.state, TrackState::kLost);
  filter::update_track(hidden, static_cast<core::TimeNs>(61.1e9), options, object);
  EXPECT_EQ(object.state, TrackState::kLost);
}

TEST(TrackState, ExistenceFallsWithContradictionAndRecovers) {
  belief::ObjectBelief object;
  object.existence = 0.9;
  const filter::TrackStateOptions options;
  for (int i = 1; i < 40; ++i) filter::update_track(seen(-3.0), i * kFrameNs, options, object);
  EXPECT_LT(object.existence, 0.01);
  EXPECT_GT(object.existence, 0.0);
  for (int i = 40; i < 80; ++i) filter::update_track(seen(5.0), i * kFrameNs, options, object);
  EXPECT_GT(object.existence, 0.99);
  EXPECT_LT(object.existence, 1.0);
}

}  // namespace
}  // namespace prescene::filter_tests
