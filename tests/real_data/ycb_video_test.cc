// SPDX-License-Identifier: Apache-2.0
// Figures on real frames (14 objects in 3 frames), and the error measures against published numbers.
#include "prescene/service/evaluate/ycb_video.h"

#include <gtest/gtest.h>

#include "tests/support/paths.h"

namespace prescene::service {
namespace {

TEST(YcbVideo, FindsDisturbedObjectsAgain) {
  const auto dir = tests::data_dir("ycb_video");
  if (!dir) GTEST_SKIP() << tests::missing_data_message("ycb_video");
  core::ThreadPool threads;
  const auto section = evaluate_disturbed(*dir, 1, threads);
  ASSERT_TRUE(section.ok()) << section.status().message();
  EXPECT_EQ(section->n, 280);
  EXPECT_EQ(section->objects.size(), 14u);
  EXPECT_GE(section->share_adds_below_2cm, 0.93);
  EXPECT_LE(section->median_adds_m, 0.004);
}

TEST(YcbVideo, FindsObjectsInTheFrameAlone) {
  const auto dir = tests::data_dir("ycb_video");
  if (!dir) GTEST_SKIP() << tests::missing_data_message("ycb_video");
  core::ThreadPool one_thread(1), two_threads(2);
  const auto section = evaluate_amortised(*dir, 1, two_threads);
  ASSERT_TRUE(section.ok()) << section.status().message();
  EXPECT_EQ(section->n, 14);
  EXPECT_GE(section->found, 12);
  EXPECT_LE(section->false_detections, 2);
  const auto again = evaluate_amortised(*dir, 1, one_thread);
  ASSERT_TRUE(again.ok());
  for (std::size_t i = 0; i < section->objects.size(); ++i)
    EXPECT_EQ(section->objects[i].median_adds_m, again->objects[i].median_adds_m) << section->objects[i].object;
}

TEST(YcbVideo, ReproducesThePublishedAreas) {
  const auto dir = tests::data_dir("ycb_video");
  if (!dir) GTEST_SKIP() << tests::missing_data_message("ycb_video");
  core::ThreadPool threads;
  const auto rows = evaluate_auc(*dir, threads);
  ASSERT_TRUE(rows.ok()) << rows.status().message();
  EXPECT_EQ(rows->size(), 88u);
  for (const YcbAucRow& row : *rows) {
    EXPECT_NEAR(row.add, row.expected_add, 0.01) << row.method << " " << row.object;
    EXPECT_NEAR(row.adds, row.expected_adds, 0.01) << row.method << " " << row.object;
  }
}

}  // namespace
}  // namespace prescene::service
