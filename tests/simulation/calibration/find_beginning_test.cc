// SPDX-License-Identifier: Apache-2.0
// Motions made by hand from the laws of falling and sliding, with a tracker's noise.
#include "prescene/simulation/calibration/find_beginning.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "prescene/geometry/sampling.h"
#include "prescene/simulation/calibration/clearance.h"
#include "prescene/simulation/calibration/free_fall.h"
#include "prescene/simulation/lockstep/lockstep_simulator.h"
#include "tests/support/simulated_motions.h"

namespace prescene::tests::find_beginning_test {
namespace {

using geometry::Pose;
using geometry::Vector3d;
using simulation::clearance_of;
using simulation::find_beginning;
using simulation::measure_whole_fall;
using simulation::MotionBeginning;
using simulation::TimedPose;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr double kHalf = 0.05;  // of box_scene's cube, m
const Vector3d kGravity(0.0, 0.0, -9.81);

class FindBeginningTest : public ::testing::Test {
 protected:
  FindBeginningTest() : scene_(box_scene({})) {
    auto made = simulation::make_lockstep_simulator(scene_, shapes_, {});
    EXPECT_TRUE(made.ok());
    simulator_ = *std::move(made);
  }

  /// One second at 120 Hz of a box at `height` above the board that is slowed down by friction from `speed`.
  static std::vector<TimedPose> slide(double speed, double height, double noise, core::RandomStream& stream) {
    constexpr double kSlowing = 0.3 * 9.81;
    std::vector<TimedPose> frames;
    for (int i = 0; i < 120; ++i) {
      const double t = std::min(i / 120.0, speed / kSlowing);
      Pose X_WO = Pose::from_translation({speed * t - 0.5 * kSlowing * t * t, 0.0, kHalf + height});
      X_WO.translation += noise * geometry::normal_vector(stream);
      X_WO.rotation = geometry::exp_rotation(10.0 * noise * geometry::normal_vector(stream));
      frames.push_back({i / 120.0, X_WO});
    }
    return frames;
  }
  std::string refusal(const std::vector<TimedPose>& frames, double noise) {
    const auto found = find_beginning("toss 7", frames, scene_, *simulator_, pool_, noise);
    return found.ok() ? "accepted" : std::string(found.status().message());
  }

  belief::Scene scene_;
  simulation::ShapeStore shapes_;
  core::ThreadPool pool_{1};
  std::unique_ptr<simulation::Simulator> simulator_;
  core::RandomStream stream_{11, core::Purpose::kTest};
};

TEST_F(FindBeginningTest, SlidesAreSlidesWhateverTheTrackersNoise) {
  for (const double noise : {0.0, 2e-4, 1e-3, 3e-3}) {
    for (int i = 0; i < 40; ++i) {
      const auto found = find_beginning("toss", slide(stream_.uniform(0.6, 1.6), 0.0, noise, stream_), scene_,
                                        *simulator_, pool_, noise);
      ASSERT_TRUE(found.ok()) << noise << ": " << found.status().message();
      EXPECT_EQ(found->beginning, MotionBeginning::kSlide);
    }
  }
}

TEST_F(FindBeginningTest, GapsAndOverlapsAreToldInMillimetres) {
  EXPECT_THAT(refusal(slide(1.0, 0.03, 2e-4, stream_), 2e-4),
              AllOf(HasSubstr("toss 7: it does not fall"), HasSubstr(" mm above a support")));
  EXPECT_THAT(refusal(slide(1.0, -0.03, 2e-4, stream_), 2e-4),
              AllOf(HasSubstr("toss 7: it begins about "), HasSubstr("(overlap)")));
  // Below the board, which is 0.2 m thick.
  EXPECT_THAT(refusal(slide(1.0, -0.4, 2e-4, stream_), 2e-4), HasSubstr("(overlap)"));
  // What tables and trackers differ by is no reason.
  EXPECT_EQ(refusal(slide(1.0, 0.002, 2e-4, stream_), 2e-4), "accepted");
  EXPECT_EQ(refusal(slide(1.0, -0.003, 2e-4, stream_), 2e-4), "accepted");
}

TEST_F(FindBeginningTest, TossesThatFallThroughTheSupportAreRefused) {
  std::vector<TimedPose> frames;
  for (int i = 0; i < 120; ++i) {
    const double t = i / 120.0;
    // It bounces 0.15 m below the board's face.
    const double z = t < 0.35 ? 0.55 - 4.905 * t * t : 0.55 - 4.905 * 0.35 * 0.35;
    frames.push_back({t, Pose::from_translation({0.3 * t, 0.0, z - 0.1 - 0.1})});
  }
  EXPECT_THAT(refusal(frames, 0.0), HasSubstr("inside of a support (overlap) in"));
}

TEST_F(FindBeginningTest, WhatDoesNotMoveTellsNothing) {
  EXPECT_THAT(refusal(slide(0.0, 0.0, 2e-4, stream_), 2e-4), HasSubstr("toss 7: it does not move"));
  EXPECT_THAT(refusal(slide(0.0, 0.0, 0.0, stream_), 0.0), HasSubstr("it does not move"));
}

TEST_F(FindBeginningTest, ClearanceIsTheWayToTheBoard) {
  for (const double height : {0.002, 0.01, 0.07, 0.5}) {
    const auto above = clearance_of(Pose::from_translation({0.0, 0.0, kHalf + height}), scene_, *simulator_, pool_);
    ASSERT_TRUE(above);
    EXPECT_NEAR(*above, height, 0.16 * height + 1e-3);
  }
  for (const double depth : {0.002, 0.01, 0.07}) {
    const auto inside = clearance_of(Pose::from_translation({0.0, 0.0, kHalf - depth}), scene_, *simulator_, pool_);
    ASSERT_TRUE(inside);
    EXPECT_NEAR(*inside, -depth, 0.16 * depth + 1e-3);
  }
  // Beside the board.
  EXPECT_FALSE(clearance_of(Pose::from_translation({5.0, 0.0, 0.3}), scene_, *simulator_, pool_));
}

TEST(FreeFall, IsUnbiasedAndItsErrorsAreAsLargeAsItSays) {
  core::RandomStream stream(3, core::Purpose::kTest);
  const Vector3d center(0.01, -0.02, 0.005);
  constexpr double kNoise = 5e-4;
  constexpr int kRepeats = 400;
  double sum = 0.0, squares = 0.0, error = 0.0;
  std::vector<TimedPose> last;
  for (int r = 0; r < kRepeats; ++r) {
    std::vector<TimedPose> frames;
    for (int i = 0; i < 12; ++i) {
      const double t = i / 120.0;
      const auto rotation = geometry::exp_rotation(Vector3d(6.0, -3.0, 2.0) * t);
      const Vector3d p = Vector3d(1.0, 0.2, 0.7) * t + 0.5 * t * t * kGravity - rotation * center +
                         kNoise * geometry::normal_vector(stream);
      frames.push_back({t, {rotation, p}});
    }
    const simulation::FreeFall fall = measure_whole_fall(frames, center, kGravity, kNoise);
    error = fall.error;
    sum += fall.acceleration - 9.81;
    squares += (fall.acceleration - 9.81) * (fall.acceleration - 9.81);
    last = frames;
  }
  // 400 draws: the mean within four of its errors, the variance within 28 % (four).
  EXPECT_NEAR(sum / kRepeats, 0.0, 4.0 * error / std::sqrt(kRepeats));
  EXPECT_NEAR(squares / kRepeats, error * error, 0.28 * error * error);
  const double noise = simulation::position_noise_of(std::vector<std::span<const TimedPose>>(20, last));
  EXPECT_NEAR(noise, kNoise, 0.6 * kNoise);
  // A tracker that repeats itself while the thing lies still is no better for that.
  for (int i = 0; i < 40; ++i) last.push_back({last.back().time + 1.0 / 120.0, last.back().X_WO});
  EXPECT_EQ(simulation::position_noise_of(std::vector<std::span<const TimedPose>>(20, last)), noise);
}

}  // namespace
}  // namespace prescene::tests::find_beginning_test
