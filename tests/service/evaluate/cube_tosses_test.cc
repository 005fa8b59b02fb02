// SPDX-License-Identifier: Apache-2.0
// The evaluator on tosses of its own making.
#include "prescene/service/evaluate/cube_tosses.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "made_tosses.h"
#include "prescene/service/calibration/forecast_scores.h"

namespace prescene::service {
namespace {

using geometry::Vector3d;
using tests::made_tosses;

/// A toss that flies freely from 0.3 m with velocity v and spin w, seen at 148 Hz until it is below the board.
CubeToss flight(const CubeModel& model, const Vector3d& v, const Vector3d& w, int frames) {
  const Vector3d center(0.0, 0.0, model.center_of_mass_z);
  CubeToss toss;
  for (int i = 0; i < frames; ++i) {
    const double t = i / 148.0;
    simulation::TimedPose frame;
    frame.time = t;
    frame.X_WO.rotation = geometry::exp_rotation(w * t) * geometry::exp_rotation({0.2, -0.4, 1.0});
    frame.X_WO.translation = Vector3d(0.1, 0.2, 0.3) + v * t - 0.5 * model.gravity * t * t * Vector3d::UnitZ() -
                             frame.X_WO.rotation * center;
    toss.frames.push_back(frame);
  }
  return toss;
}

TEST(CubeTosses, StartIsTheFlightsStateBeforeContactWhateverCameAfter) {
  const CubeModel model = measured_cube_model();
  const Vector3d v(-1.0, 0.4, -0.5);
  const Vector3d w(2.0, -3.0, 1.0);
  CubeToss toss = flight(model, v, w, 60);
  const auto lowest = [&](std::size_t i) {
    const geometry::Pose& X = toss.frames[i].X_WO;
    return X.translation.z() - model.half_edge * X.rotation.toRotationMatrix().row(2).cwiseAbs().sum();
  };
  std::size_t contact = 0;
  while (lowest(contact) >= 0.006) ++contact;
  ASSERT_GT(contact, 12u);
  // The tracker mixes the last frame before contact with the first after it.
  for (std::size_t i = contact - 1; i < toss.frames.size(); ++i) toss.frames[i].X_WO.translation.x() += 0.01;
  const auto start = start_of_toss(toss, model);
  ASSERT_TRUE(start.ok()) << start.status().message();
  const simulation::TimedPose& last = toss.frames[contact - 2];
  const Vector3d arm = last.X_WO.rotation * Vector3d(0.0, 0.0, model.center_of_mass_z);
  EXPECT_EQ(start->time, last.time);
  EXPECT_LT((start->X_WO.translation - last.X_WO.translation).norm(), 1e-9);
  EXPECT_LT(geometry::angle_between(start->X_WO.rotation, last.X_WO.rotation), 1e-7);
  EXPECT_LT((start->V_WO.angular - w).norm(), 1e-6);
  EXPECT_LT((start->V_WO.linear - (v - model.gravity * last.time * Vector3d::UnitZ() - w.cross(arm))).norm(), 1e-6);

  // Of frames more than ten before the contact nothing is used.
  toss.frames[contact - 12].X_WO.translation.y() += 1.0;
  EXPECT_EQ(start_of_toss(toss, model)->X_WO, start->X_WO);
}

TEST(CubeTosses, ATossThatIsTooShortIsNamed) {
  CubeToss toss = flight(measured_cube_model(), {0, 0, 0}, {0, 0, 0}, 2);
  toss.number = 8;
  core::ThreadPool threads(1);
  const auto forecasts = forecast_cube_tosses({toss}, measured_cube_model(), 1, threads);
  EXPECT_EQ(forecasts.status().code(), core::StatusCode::kInvalidInput);
  EXPECT_THAT(forecasts.status().message(), testing::HasSubstr("toss 8"));
}

TEST(CubeTosses, CancellingEndsTheForecasts) {
  const std::vector<CubeToss> tosses = made_tosses(measured_cube_model(), 2);
  core::ThreadPool threads(1);
  core::Cancellation cancellation;
  cancellation.request();
  EXPECT_EQ(forecast_cube_tosses(tosses, measured_cube_model(), 1, threads, {}, &cancellation).status().code(),
            core::StatusCode::kCancelled);
}

TEST(CubeTosses, ForecastsItsOwnTossesAlmostSurely) {
  CubeModel model = shipped_cube_model();
  model.position_noise = 1e-4;
  model.rotation_noise = 5e-4;
  model.velocity_noise = 1e-3;
  model.spin_noise = 5e-3;
  model.friction_noise = 0.0;
  const std::vector<CubeToss> tosses = made_tosses(model, 20);
  core::ThreadPool one(1);
  core::ThreadPool two(2);
  CubeOptions options;
  options.samples = 16;
  const auto forecasts = forecast_cube_tosses(tosses, model, 1, one, {}, nullptr, options);
  ASSERT_TRUE(forecasts.ok()) << forecasts.status().message();
  const CubeReport report = report_of(*forecasts);
  EXPECT_EQ(report.n, 20);
  EXPECT_GE(report.right_face_share, 0.95);
  EXPECT_LT(report.brier, 0.1);
  EXPECT_LT(report.median_xy_error_m, 0.003);

  const auto again = forecast_cube_tosses(tosses, model, 1, two, {}, nullptr, options);
  ASSERT_TRUE(again.ok());
  for (std::size_t i = 0; i < forecasts->size(); ++i) {
    EXPECT_EQ((*again)[i].face_probabilities, (*forecasts)[i].face_probabilities);
    EXPECT_EQ((*again)[i].place, (*forecasts)[i].place);
    EXPECT_EQ((*again)[i].region_mass, (*forecasts)[i].region_mass);
  }
}

TEST(CubeTosses, ReportHasTheKeysOfTheEvaluator) {
  CubeForecast forecast;
  forecast.face_probabilities = {0.9, 0.02, 0.02, 0.02, 0.02, 0.02};
  forecast.place = {0.03, 0.04};
  forecast.region_mass = 0.6;
  const nlohmann::ordered_json json = to_json(report_of({forecast}));
  EXPECT_EQ(json.dump(), R"({"n":1,"right_face_share":1.0,"brier":)" +
                             nlohmann::json(brier_score(forecast.face_probabilities, 0)).dump() + R"(,"log_score":)" +
                             nlohmann::json(std::log(0.9)).dump() +
                             R"(,"median_xy_error_m":0.05,"p90_xy_error_m":0.05,"coverage_50":0.0,"coverage_90":1.0})");
}

}  // namespace
}  // namespace prescene::service
