// SPDX-License-Identifier: Apache-2.0
// Simulated tosses that are then cut, pushed, copied or torn apart.
#include "prescene/simulation/calibration/recording_checks.h"

#include <gtest/gtest.h>

#include <cmath>

#include "prescene/geometry/sampling.h"
#include "prescene/simulation/calibration/free_fall.h"
#include "prescene/simulation/calibration/motion_forecast.h"
#include "prescene/simulation/lockstep/lockstep_simulator.h"
#include "tests/support/simulated_motions.h"

namespace prescene::tests::recording_checks_test {
namespace {

using geometry::Pose;
using geometry::Vector3d;
using simulation::find_rest;
using simulation::find_stamp_jump;
using simulation::find_twins;
using simulation::TimedPose;

using Frames = std::vector<TimedPose>;

class RecordingChecksTest : public ::testing::Test {
 protected:
  RecordingChecksTest() : scene_(box_scene({})) {
    auto made = simulation::make_lockstep_simulator(scene_, shapes_, {});
    EXPECT_TRUE(made.ok());
    for (const SimulatedMotion& motion :
         simulated_tosses(scene_, **made, 8, core::RandomStream(5, core::Purpose::kTest), pool_)) {
      Frames& frames = tosses_.emplace_back();
      for (std::size_t i = 0; i < motion.times.size(); ++i) frames.push_back({motion.times[i], motion.X_WO[i]});
    }
  }

  /// `frames`, and then so many seconds in which it stays where it is, with the tracker's noise.
  static Frames resting(Frames frames, double seconds) {
    core::RandomStream stream(7, core::Purpose::kTest);
    const TimedPose end = frames.back();
    for (int i = 1; i <= static_cast<int>(seconds * 120.0); ++i) {
      TimedPose frame = end;
      frame.time += i / 120.0;
      frame.X_WO.translation += 2e-4 * geometry::normal_vector(stream);
      frames.push_back(frame);
    }
    return frames;
  }
  static Frames turned(Frames frames, double yaw, const Vector3d& shift) {
    const Pose X{geometry::exp_rotation(yaw * Vector3d::UnitZ()), shift};
    for (TimedPose& frame : frames) frame.X_WO = X * frame.X_WO;
    return frames;
  }

  belief::Scene scene_;
  simulation::ShapeStore shapes_;
  core::ThreadPool pool_{1};
  std::vector<Frames> tosses_;
};

TEST_F(RecordingChecksTest, RestIsWhereItLiesAndNotTheLastRows) {
  for (const Frames& toss : tosses_) {
    Frames frames = resting(toss, 0.3);
    const std::size_t pushed = frames.size();
    const auto quiet = find_rest(frames, 2e-4, 2e-3);
    ASSERT_TRUE(quiet.has_value());
    EXPECT_EQ(quiet->last, pushed - 1);
    EXPECT_FALSE(quiet->moves_again.has_value());
    // A hand pushes it away by 3 cm.
    for (int i = 1; i <= 30; ++i) {
      TimedPose frame = frames[pushed - 1];
      frame.time += i / 120.0;
      frame.X_WO.translation.x() += 1e-3 * i;
      frames.push_back(frame);
    }
    const auto rest = find_rest(frames, 2e-4, 2e-3);
    ASSERT_TRUE(rest.has_value());
    ASSERT_TRUE(rest->moves_again.has_value());
    EXPECT_NEAR(static_cast<double>(*rest->moves_again), static_cast<double>(pushed), 3.0);
    EXPECT_NEAR(rest->moved, 0.03, 2e-3);
    EXPECT_LT((frames[rest->first].X_WO.translation - frames[pushed - 1].X_WO.translation).norm(), 2.5e-3);
  }
}

TEST_F(RecordingChecksTest, WhatIsCutWhileItMovesHasNoRest) {
  for (const Frames& toss : tosses_) {
    // Free fall, up to the first contact at the latest.
    const Frames falling(toss.begin(), toss.begin() + 20);
    EXPECT_FALSE(find_rest(falling, 2e-4, 2e-3).has_value());
  }
  EXPECT_FALSE(find_rest({}, 2e-4).has_value());
}

TEST_F(RecordingChecksTest, OneFrameThatIsOffIsNoTouch) {
  Frames frames = resting(tosses_[0], 0.5);
  frames[frames.size() - 10].X_WO.translation.x() += 2e-3;
  const auto rest = find_rest(frames, 2e-4, 2e-3);
  ASSERT_TRUE(rest.has_value());
  EXPECT_FALSE(rest->moves_again.has_value());
}

TEST_F(RecordingChecksTest, TwinsAreTheSameUpToYawAndShift) {
  std::vector<Frames> all = tosses_;
  all.push_back(turned(tosses_[2], 1.1, {0.3, -0.2, 0.0}));
  // One that begins ten frames later, and ends as much earlier.
  Frames cut = turned(tosses_[5], -2.0, {0.0, 0.5, 0.0});
  all.emplace_back(cut.begin() + 10, cut.end() - 10);
  // Tilted, or higher: another motion.
  Frames higher = tosses_[1];
  for (TimedPose& frame : higher) frame.X_WO.translation.z() += 1e-3;
  all.push_back(higher);
  const std::vector<std::span<const TimedPose>> spans(all.begin(), all.end());
  const std::vector<std::size_t> twins = find_twins(spans);
  for (std::size_t i = 0; i < tosses_.size(); ++i) EXPECT_EQ(twins[i], i);
  EXPECT_EQ(twins[8], 2U);
  EXPECT_EQ(twins[9], 5U);
  EXPECT_EQ(twins[10], 10U);
}

TEST_F(RecordingChecksTest, SlidesOnALevelBoardAreNoTwins) {
  std::vector<Frames> slides(2);
  for (std::size_t k = 0; k < slides.size(); ++k) {
    for (int i = 0; i < 60; ++i)
      slides[k].push_back({i / 120.0, Pose::from_translation({0.01 * (k + 1.0) * i, 0.0, 0.05})});
  }
  const std::vector<std::span<const TimedPose>> spans(slides.begin(), slides.end());
  EXPECT_EQ(find_twins(spans), (std::vector<std::size_t>{0, 1}));
}

TEST_F(RecordingChecksTest, StampsThatJumpAreFound) {
  EXPECT_FALSE(find_stamp_jump(tosses_[0]).has_value());
  Frames frames = tosses_[0];
  for (std::size_t i = 30; i < frames.size(); ++i) frames[i].time += 0.5;
  EXPECT_EQ(find_stamp_jump(frames), 30U);
  EXPECT_FALSE(find_stamp_jump({}).has_value());
}

TEST_F(RecordingChecksTest, RotationNoiseIsTheTrackers) {
  std::vector<std::span<const TimedPose>> spans;
  for (const Frames& toss : tosses_) spans.push_back(std::span(toss).first(20));
  EXPECT_NEAR(simulation::rotation_noise_of(spans), 2e-3, 4e-4);
}

TEST_F(RecordingChecksTest, ForecastsDoNotDependOnWhatElseIsForetoldOrOnThreads) {
  std::vector<simulation::RecordedMotion> motions;
  for (std::size_t i = 0; i < 3; ++i) motions.push_back({"toss", tosses_[i], simulation::MotionBeginning::kFlight, 8});
  const simulation::SimulatorFactory make = [this](const belief::Scene& scene, double) {
    return simulation::make_lockstep_simulator(scene, shapes_, {});
  };
  simulation::ForecastOptions options;
  options.samples = 8;
  const core::RandomStream stream(3, core::Purpose::kTest);
  const simulation::ThrowScatter scatter{1e-3, 5e-3, 0.05};
  const std::vector<std::size_t> numbers = {4, 1, 9};
  const auto all = simulation::forecast_motions(motions, numbers, scene_, scatter, make, stream, pool_, options);
  ASSERT_TRUE(all.ok()) << all.status().message();
  core::ThreadPool two(2);
  const auto again = simulation::forecast_motions(motions, numbers, scene_, scatter, make, stream, two, options);
  const auto one = simulation::forecast_motions(std::span(motions).subspan(1, 1), std::span(numbers).subspan(1, 1),
                                                scene_, scatter, make, stream, pool_, options);
  ASSERT_TRUE(again.ok() && one.ok());
  for (std::size_t i = 0; i < 3; ++i) {
    ASSERT_EQ((*all)[i].ends.size(), 8U);
    for (std::size_t k = 0; k < 8; ++k) EXPECT_EQ((*all)[i].ends[k].translation, (*again)[i].ends[k].translation);
  }
  for (std::size_t k = 0; k < 8; ++k) EXPECT_EQ((*all)[1].ends[k].translation, (*one)[0].ends[k].translation);
  // Without any scatter all samples end where it was recorded to, as near as a start that is read off frames allows.
  const auto sure = simulation::forecast_motions(motions, numbers, scene_, {}, make, stream, pool_, options);
  ASSERT_TRUE(sure.ok());
  for (const auto& forecast : *sure)
    for (const Pose& end : forecast.ends) EXPECT_EQ(end.translation, forecast.ends[0].translation);
}

}  // namespace
}  // namespace prescene::tests::recording_checks_test
