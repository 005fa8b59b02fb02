// SPDX-License-Identifier: Apache-2.0
// The transparent material on real frames of transparent things (docs/studies/accuracy.md).
#include "prescene/service/evaluate/cleargrasp.h"

#include <gtest/gtest.h>

#include "tests/support/paths.h"

namespace prescene::service {
namespace {

TEST(ClearGraspFrames, AreBetterExplainedAsTransparentAndTheirPaintedTwinsAsOpaque) {
  const auto dir = tests::data_dir("cleargrasp");
  if (!dir) GTEST_SKIP() << tests::missing_data_message("cleargrasp");
  const auto report = evaluate_cleargrasp(*dir, 1);
  ASSERT_TRUE(report.ok()) << report.status().message();
  ASSERT_EQ(report->frames.size(), 2u);
  EXPECT_GT(report->total.all.n, 100'000);
  EXPECT_TRUE(report->total.knows_plane);
  // 92 % of the mask's pixels, 0.6 % of the painted twin's.
  EXPECT_GT(report->total.all.share(), 0.90);
  EXPECT_LT(report->total.painted.share(), 0.02);
  for (const ClearGraspScore& score : report->frames) EXPECT_GT(score.all.nats_per_pixel(), 1.0) << score.frame;
}

}  // namespace
}  // namespace prescene::service
