// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/operators/track_state.h"

#include <gtest/gtest.h>

#include "prescene/core/clock.h"
#include "prescene/core/random.h"
#include "prescene/filter/proposals/learned_colors.h"

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

/// A frame of the only camera.
filter::TrackedBy at(core::TimeNs stamp_ns) {
  static const std::vector<belief::CameraRecord> kNoOthers;
  return {kNoOthers, 0, stamp_ns};
}

TEST(TrackState, FollowsTheEvidence) {
  belief::ObjectBelief object;
  const filter::TrackStateOptions options;
  filter::update_track(seen(5.0), at(kFrameNs), options, object);
  EXPECT_EQ(object.state, TrackState::kTracked);
  EXPECT_EQ(object.last_seen_ns, kFrameNs);
  filter::update_track(seen(2.0), at(2 * kFrameNs), options, object);
  EXPECT_EQ(object.state, TrackState::kDoubtful);
  EXPECT_EQ(object.frames_unseen, 1);
  EXPECT_EQ(object.last_seen_ns, kFrameNs);
  filter::update_track(seen(5.0), at(3 * kFrameNs), options, object);
  EXPECT_EQ(object.frames_unseen, 0);
}

TEST(TrackState, AsksOfAPoseWhatItCanSay) {
  // Of a transparent thing 2 nats a pixel are expected: half of the usual limits' share of that is enough.
  belief::ObjectBelief object;
  WeightReport report = seen(1.2);
  report.expected_evidence = 2.0;
  filter::update_track(report, at(kFrameNs), {}, object);
  EXPECT_EQ(object.state, TrackState::kTracked);
  report.expected_evidence = 6.5;
  filter::update_track(report, at(2 * kFrameNs), {}, object);
  EXPECT_EQ(object.state, TrackState::kDoubtful);
  EXPECT_EQ(filter::evidence_scale(6.5), 1.0);
  EXPECT_GT(filter::evidence_scale(0.0), 0.0);
  EXPECT_EQ(filter::evidence_scale(std::numeric_limits<double>::infinity()), 1.0);
}

TEST(TrackState, AveragesWhatOneFrameSaysTooLittleOf) {
  // Of a right pose 1 nat a pixel is expected, within 0.5: one frame in six would fall below the limit of a half.
  const filter::TrackStateOptions options;
  core::RandomStream stream(5, core::Purpose::kTest);
  const auto noisy = [&](double mean) {
    WeightReport report = seen(mean + 0.5 * stream.normal());
    report.expected_evidence = 1.0;
    report.evidence_deviation = 0.5;
    return report;
  };
  belief::ObjectBelief object;
  int tracked = 0;
  for (int i = 0; i < 1000; ++i) {
    filter::update_track(noisy(1.0), at((i + 1) * kFrameNs), options, object);
    tracked += object.state == TrackState::kTracked;
  }
  EXPECT_GE(tracked, 980);
  // A pose that becomes wrong is not held for tracked for long.
  int still_tracked = 0;
  bool was_lost = false;
  for (int i = 1000; i < 1030; ++i) {
    filter::update_track(noisy(-0.7), at((i + 1) * kFrameNs), options, object);
    still_tracked += object.state == TrackState::kTracked;
    was_lost = was_lost || object.state == TrackState::kLost;
  }
  EXPECT_LE(still_tracked, 4);
  EXPECT_TRUE(was_lost);
}

TEST(TrackState, ForgetsWhatWasSeenBeforeItWasHidden) {
  belief::ObjectBelief object;
  const filter::TrackStateOptions options;
  WeightReport right = seen(1.0);
  right.expected_evidence = 1.0;
  right.evidence_deviation = 1.0;
  WeightReport wrong = right;
  wrong.evidence_per_pixel = -0.2;
  WeightReport hidden;
  hidden.hidden_weight = 1.0;
  for (int i = 1; i < 20; ++i) filter::update_track(right, at(i * kFrameNs), options, object);
  filter::update_track(wrong, at(20 * kFrameNs), options, object);
  EXPECT_EQ(object.state, TrackState::kTracked);
  filter::update_track(hidden, at(21 * kFrameNs), options, object);
  filter::update_track(wrong, at(22 * kFrameNs), options, object);
  EXPECT_EQ(object.state, TrackState::kDoubtful);
  EXPECT_EQ(object.evidence_per_pixel, -0.2);
}

TEST(TrackState, IsLostOnlyAfterSomeFramesOfContradiction) {
  belief::ObjectBelief object;
  const filter::TrackStateOptions options;
  for (int i = 1; i < options.lost_after_frames; ++i) {
    filter::update_track(seen(-1.0), at(i * kFrameNs), options, object);
    EXPECT_EQ(object.state, TrackState::kDoubtful) << i;
  }
  filter::update_track(seen(-1.0), at(options.lost_after_frames * kFrameNs), options, object);
  EXPECT_EQ(object.state, TrackState::kLost);
}

TEST(TrackState, HidingEndsTheContradiction) {
  belief::ObjectBelief object;
  const filter::TrackStateOptions options;
  WeightReport hidden;
  hidden.hidden_weight = 0.9;
  for (int i = 1; i < 40; ++i) {
    filter::update_track(i % options.lost_after_frames == 0 ? hidden : seen(-1.0), at(i * kFrameNs), options, object);
    EXPECT_NE(object.state, TrackState::kLost) << i;
  }
}

TEST(TrackState, AFewPixelsAreNotEnoughToBeSure) {
  belief::ObjectBelief object;
  const filter::TrackStateOptions options;
  WeightReport corner = seen(9.0);
  corner.visible_pixels = 4;
  filter::update_track(corner, at(kFrameNs), options, object);
  EXPECT_EQ(object.state, TrackState::kDoubtful);
  for (int i = 2; i < 20; ++i) filter::update_track(corner, at(i * kFrameNs), options, object);
  EXPECT_EQ(object.state, TrackState::kDoubtful);
  corner.visible_pixels = 5;
  filter::update_track(corner, at(20 * kFrameNs), options, object);
  EXPECT_EQ(object.state, TrackState::kTracked);
}

TEST(TrackState, HiddenIsUnseenUntilItIsTooLong) {
  belief::ObjectBelief object;
  const filter::TrackStateOptions options;
  filter::update_track(seen(5.0), at(0), options, object);
  const double existence = object.existence;
  WeightReport hidden;
  hidden.hidden_weight = 0.9;
  filter::update_track(hidden, at(static_cast<core::TimeNs>(59e9)), options, object);
  EXPECT_EQ(object.state, TrackState::kUnseen);
  EXPECT_EQ(object.existence, existence);  // hidden says nothing
  filter::update_track(hidden, at(static_cast<core::TimeNs>(61e9)), options, object);
  EXPECT_EQ(object.state, TrackState::kLost);
  filter::update_track(hidden, at(static_cast<core::TimeNs>(61.1e9)), options, object);
  EXPECT_EQ(object.state, TrackState::kLost);
}

TEST(TrackState, WhatWasDoubtfulForLongIsNotLostWhenItIsHidden) {
  belief::ObjectBelief object;
  filter::update_track(seen(5.0), at(0), {}, object);
  for (int s = 1; s <= 100; ++s) filter::update_track(seen(2.0), at(s * core::ns_of(1.0)), {}, object);
  ASSERT_EQ(object.state, TrackState::kDoubtful);
  WeightReport hidden;
  hidden.hidden_weight = 0.9;
  filter::update_track(hidden, at(core::ns_of(100.1)), {}, object);
  EXPECT_EQ(object.state, TrackState::kUnseen);
  filter::update_track(hidden, at(core::ns_of(159.0)), {}, object);
  EXPECT_EQ(object.state, TrackState::kUnseen);
  filter::update_track(hidden, at(core::ns_of(161.0)), {}, object);
  EXPECT_EQ(object.state, TrackState::kLost);
}

TEST(TrackState, WhatWasFoundIsSeenThereAndDidNotMoveThere) {
  belief::ObjectBelief object;
  object.particles.resize(1);
  object.particles[0].X_WO.translation = {0.3, 0.0, 0.0};
  object.motion.still_frames = 50;
  filter::mark_found(at(core::ns_of(70.0)), object);
  EXPECT_EQ(object.motion.X_still.translation, object.particles[0].X_WO.translation);
  WeightReport hidden;
  hidden.hidden_weight = 0.9;
  filter::update_track(hidden, at(core::ns_of(70.1)), {}, object);
  EXPECT_EQ(object.state, TrackState::kUnseen);
}

TEST(TrackState, ExistenceFallsWithContradictionAndRecovers) {
  belief::ObjectBelief object;
  object.existence = 0.9;
  const filter::TrackStateOptions options;
  for (int i = 1; i < 40; ++i) filter::update_track(seen(-3.0), at(i * kFrameNs), options, object);
  EXPECT_LT(object.existence, 0.01);
  EXPECT_GT(object.existence, 0.0);
  for (int i = 40; i < 80; ++i) filter::update_track(seen(5.0), at(i * kFrameNs), options, object);
  EXPECT_GT(object.existence, 0.99);
  EXPECT_LT(object.existence, 1.0);
}

/// Two cameras that take frames in turn, one object, and what each frame says of it.
class TwoCameras : public testing::Test {
 protected:
  TwoCameras() { belief_.cameras.resize(2); }

  /// The next frame, of `camera`, half a period after the one before.
  TrackState frame(int camera, const WeightReport& report) {
    belief::Observation observation;
    observation.camera = camera;
    observation.stamp_ns = now_ns_ += kFrameNs / 2;
    filter::note_frame(observation, belief_);
    filter::update_track(report, {belief_.cameras, camera, now_ns_}, {}, object_);
    return object_.state;
  }

  belief::Belief belief_;
  belief::ObjectBelief object_;
  core::TimeNs now_ns_ = kFrameNs;
};

TEST_F(TwoCameras, KeepTrackedWhatEitherSees) {
  WeightReport hidden;
  hidden.hidden_weight = 1.0;
  EXPECT_EQ(frame(0, hidden), TrackState::kUnseen);
  for (int i = 0; i < 20; ++i) {
    EXPECT_EQ(frame(1, seen(5.0)), TrackState::kTracked) << i;
    EXPECT_EQ(frame(0, hidden), TrackState::kTracked) << i;
    EXPECT_EQ(object_.visible_share, 0.8);
    EXPECT_EQ(object_.frames_unseen, 0);
    EXPECT_TRUE(filter::was_unseen_by(object_, 0));
    EXPECT_FALSE(filter::was_unseen_by(object_, 1));
  }
  frame(1, hidden);
  EXPECT_EQ(frame(0, hidden), TrackState::kUnseen) << "hidden in both";
}

TEST_F(TwoCameras, SayNothingAnyMoreWhenTheyStop) {
  WeightReport out_of_view;
  frame(1, seen(5.0));
  frame(0, out_of_view);
  frame(1, seen(5.0));
  // The other goes on alone: after two and a half periods nothing speaks for the object.
  int kept = 0;
  while (kept < 20 && frame(0, out_of_view) == TrackState::kTracked) ++kept;
  EXPECT_EQ(kept, 5) << "half periods";
  EXPECT_EQ(object_.state, TrackState::kUnseen);
}

TEST_F(TwoCameras, AreHeardByTheirPixels) {
  // One sees a corner of it that fits, the other all of it where nothing is.
  WeightReport corner = seen(6.0);
  corner.visible_pixels = 6;
  WeightReport whole = seen(-4.0);
  whole.visible_pixels = 200;
  for (int i = 0; i < 4; ++i) {
    frame(0, corner);
    frame(1, whole);
  }
  EXPECT_EQ(object_.state, TrackState::kLost);
  EXPECT_NEAR(object_.evidence_per_pixel, (6 * 6.0 - 200 * 4.0) / 206, 1e-12);
}

TEST_F(TwoCameras, LearnTheirOwnColours) {
  frame(1, seen(5.0));
  filter::colors_by(0, object_).frames = 3;
  filter::colors_by(1, object_).frames = 7;
  EXPECT_EQ(object_.colors.frames, 3);
  EXPECT_EQ(object_.views.at(1).colors.frames, 7);
  const belief::ObjectBelief& known = object_;
  EXPECT_EQ(filter::colors_by(1, known), &object_.views.at(1).colors);
  EXPECT_EQ(filter::colors_by(2, known), nullptr);
}

}  // namespace
}  // namespace prescene::filter_tests
