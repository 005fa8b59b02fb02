// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/evaluate/cube_calibration.h"

#include <gtest/gtest.h>

#include "made_tosses.h"

namespace prescene::service {
namespace {

using tests::made_tosses;

TEST(CubeCalibration, MeasuresLengthsAndGravity) {
  CubeModel model = shipped_cube_model();
  const std::vector<CubeToss> tosses = made_tosses(model, 6);
  const auto measured = measure_cube(tosses, model);
  ASSERT_TRUE(measured.ok());
  EXPECT_NEAR(measured->half_edge, model.half_edge, 2e-5);
  // Frames fall on the next step of 1 ms, which is 0.3 ms late on average.
  EXPECT_NEAR(measured->gravity, model.gravity, 0.02);
}

TEST(CubeCalibration, FindsTheFrictionThatItWasMadeWith) {
  CubeModel model = shipped_cube_model();
  model.step = 1.0 / 240.0;
  model.friction_noise = 0.0;
  const std::vector<CubeToss> tosses = made_tosses(model, 12);
  CubeModel wrong = model;
  wrong.sliding_friction += 0.06;
  core::ThreadPool threads(1);
  CalibrationOptions options;
  options.samples = 8;
  options.max_evaluations = 25;
  const auto found = calibrate_cube(tosses, wrong, 3, threads, {}, nullptr, options);
  ASSERT_TRUE(found.ok()) << found.status().message();
  EXPECT_NEAR(found->model.sliding_friction, model.sliding_friction, 0.03);
}

TEST(CubeCalibration, WidensNoiseThatIsTooSmallForTheTosses) {
  CubeModel model = shipped_cube_model();
  model.step = 1.0 / 240.0;
  const std::vector<CubeToss> tosses = made_tosses(model, 20);
  CubeModel sure = model;
  sure.friction_noise = 0.0;
  for (double CubeModel::*noise :
       {&CubeModel::position_noise, &CubeModel::rotation_noise, &CubeModel::velocity_noise, &CubeModel::spin_noise})
    sure.*noise *= 0.1;
  sure.sliding_friction *= 1.15;  // what it is sure of is wrong
  core::ThreadPool threads(1);
  CalibrationOptions options;
  options.samples = 8;
  options.max_evaluations = 1;  // no search
  const auto found = calibrate_cube(tosses, sure, 3, threads, {}, nullptr, options);
  ASSERT_TRUE(found.ok()) << found.status().message();
  EXPECT_GT(found->widened, 1.0);
  EXPECT_NEAR(found->model.velocity_noise, found->widened * sure.velocity_noise, 1e-12);
  if (found->widened < 2.0) {
    auto forecasts = forecast_cube_tosses(tosses, found->model, 3, threads);
    EXPECT_GE(report_of(*std::move(forecasts)).coverage_90, 0.9);
  }
}

TEST(CubeCalibration, IsTheSameForAnyNumberOfThreads) {
  CubeModel model = measured_cube_model();
  model.step = 1.0 / 240.0;
  const std::vector<CubeToss> tosses = made_tosses(model, 4);
  CalibrationOptions options;
  options.samples = 4;
  options.max_evaluations = 8;
  core::ThreadPool one(1);
  core::ThreadPool two(2);
  const auto a = calibrate_cube(tosses, described_cube_model(), 3, one, {}, nullptr, options);
  const auto b = calibrate_cube(tosses, described_cube_model(), 3, two, {}, nullptr, options);
  ASSERT_TRUE(a.ok() && b.ok());
  EXPECT_EQ(a->cost, b->cost);
  EXPECT_EQ(a->evaluations, b->evaluations);
  EXPECT_EQ(a->model.sliding_friction, b->model.sliding_friction);
  EXPECT_LE(a->cost, a->start_cost);
}

TEST(CubeCalibration, KeepsTheBestSoFarWhenStopped) {
  CubeModel model = measured_cube_model();
  model.step = 1.0 / 240.0;
  const std::vector<CubeToss> tosses = made_tosses(model, 4);
  CalibrationOptions options;
  options.samples = 4;
  core::ThreadPool threads(1);
  core::Cancellation cancellation;
  int told = 0;
  const auto stop_after_three = [&](const core::Progress&) {
    if (++told == 3) cancellation.request();
  };
  const auto found = calibrate_cube(tosses, model, 3, threads, stop_after_three, &cancellation, options);
  ASSERT_TRUE(found.ok()) << found.status().message();
  EXPECT_TRUE(found->stopped);
  EXPECT_LT(found->evaluations, 6);
  EXPECT_LE(found->cost, found->start_cost);

  // Asked to stop before the first: there is nothing to keep.
  const auto none = calibrate_cube(tosses, model, 3, threads, {}, &cancellation, options);
  EXPECT_EQ(none.status().code(), core::StatusCode::kCancelled);
}

TEST(CubeCalibration, TossesWithoutAFlightAreRefused) {
  CubeToss short_toss;
  short_toss.number = 6;
  for (int i = 0; i < 5; ++i) {
    short_toss.frames.push_back({i / 148.0, geometry::Pose::from_translation({0.0, 0.0, 0.2 - 0.01 * i})});
  }
  core::ThreadPool threads(1);
  EXPECT_EQ(measure_cube({short_toss}, measured_cube_model()).status().code(), core::StatusCode::kInvalidInput);
  EXPECT_EQ(calibrate_cube({short_toss}, measured_cube_model(), 1, threads).status().code(),
            core::StatusCode::kInvalidInput);
}

}  // namespace
}  // namespace prescene::service
