// SPDX-License-Identifier: Apache-2.0
// Forecasts of real tosses (142 that no parameter was fitted to).
#include "prescene/service/evaluate/cube_tosses.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <span>
#include <vector>

#include "prescene/simulation/calibration/flight_calibration.h"
#include "tests/support/paths.h"

namespace prescene::service {
namespace {

TEST(CubeTosses, ForecastsFaceAndPlaceOfTossesItWasNotFittedTo) {
  const auto dir = tests::data_dir("cube_tosses");
  if (!dir) GTEST_SKIP() << tests::missing_data_message("cube_tosses");
  core::ThreadPool threads;
  CubeOptions options;
  options.samples = 24;  // of 64: enough for the limits below in a third of the time
  const auto report = evaluate_cube_tosses(*dir, CubeSplit::kReport, 1, threads, {}, nullptr, std::nullopt, options);
  ASSERT_TRUE(report.ok()) << report.status().message();
  EXPECT_EQ(report->n, 142);
  EXPECT_LE(report->median_xy_error_m, 0.020);
  EXPECT_GE(report->right_face_share, 0.88);
  EXPECT_LE(report->brier, 0.16);
  EXPECT_GE(report->log_score, -0.35);
  EXPECT_GE(report->coverage_90, 0.83);
  EXPECT_LE(report->coverage_90, 0.97);
}

/// The frames of a toss while all of the cube is more than 8 mm above the board, but for the last, which the tracker's
/// median mixes with the next.
std::span<const simulation::TimedPose> flight_of(const CubeToss& toss, double half_edge) {
  const auto contact = std::ranges::find_if(toss.frames, [&](const simulation::TimedPose& frame) {
    const double reach = half_edge * frame.X_WO.rotation.toRotationMatrix().row(2).cwiseAbs().sum();
    return frame.X_WO.translation.z() - reach < 0.008;
  });
  const auto frames = static_cast<std::size_t>(contact - toss.frames.begin());
  return std::span(toss.frames).first(frames - std::min<std::size_t>(frames, 1));
}

TEST(CubeTosses, FlightsAloneTellThatTheCubeIsLoaded) {
  const auto dir = tests::data_dir("cube_tosses");
  if (!dir) GTEST_SKIP() << tests::missing_data_message("cube_tosses");
  const auto tosses = read_cube_tosses(*dir);
  ASSERT_TRUE(tosses.ok()) << tosses.status().message();
  std::vector<std::span<const simulation::TimedPose>> flights;
  for (const CubeToss& toss : *tosses) flights.push_back(flight_of(toss, shipped_cube_model().half_edge));
  const auto found = simulation::calibrate_flights(flights, {});
  ASSERT_TRUE(found.ok()) << found.status().message();
  EXPECT_GE(found->flights, 270);
  // The model that was fitted to what happens after contact.
  const double height = shipped_cube_model().center_of_mass_z;
  const double error = found->standard_error(simulation::FlightParameter::kCenterOfMassZ);
  EXPECT_LT(error, 6e-4);
  EXPECT_NEAR(found->center_of_mass.z(), height, 2.5 * error);
  EXPECT_LT(found->center_of_mass.head<2>().norm(), 1e-3);
  EXPECT_NEAR(found->gravity_W.z(), -9.6, 0.02);
  EXPECT_LT(found->inertia_stretch.z(), 1.0);
  EXPECT_LT(found->rotation_noise, 1e-3);
}

}  // namespace
}  // namespace prescene::service
