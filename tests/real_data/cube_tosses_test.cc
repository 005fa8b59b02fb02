// SPDX-License-Identifier: Apache-2.0
// Forecasts of real tosses (142 that no parameter was fitted to).
#include "prescene/service/evaluate/cube_tosses.h"

#include <gtest/gtest.h>

#include "prescene/tests/support/paths.h"

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
  // Measured 0.82: the regions are somewhat narrow (docs/accuracy.md). This guards against much worse.
  EXPECT_GE(report->coverage_90, 0.78);
  EXPECT_LE(report->coverage_90, 0.97);
}

}  // namespace
}  // namespace prescene::service
