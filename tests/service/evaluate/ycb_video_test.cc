// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/evaluate/ycb_video.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

#include "prescene/service/evaluate/pose_auc.h"
#include "prescene/service/evaluate/ycb_data.h"
#include "tests/support/paths.h"

namespace prescene::service {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Two of four poses below 10 cm, at 2 cm and 6 cm. Between the errors the share at the upper one counts:
// (0.02 * 1/4 + 0.04 * 2/4 + 0.04 * 2/4) / 0.1.
TEST(PoseAuc, StepwiseAreaCountsTheShareAtTheUpperError) {
  EXPECT_NEAR(stepwise_auc({kInfinity, 0.06, 0.02, 0.30}), 0.45, 1e-12);
}

// The true area under the same steps: (0.04 * 1/4 + 0.04 * 2/4) / 0.1.
TEST(PoseAuc, LinearAreaIsThatUnderTheSteps) { EXPECT_NEAR(linear_auc({kInfinity, 0.06, 0.02, 0.30}), 0.30, 1e-12); }

TEST(PoseAuc, EndsOfTheScale) {
  EXPECT_EQ(stepwise_auc({0.0, 0.0}), 1.0);
  EXPECT_EQ(stepwise_auc({kInfinity}), 0.0);
  EXPECT_EQ(stepwise_auc({0.1000001}), 0.0);
  EXPECT_NEAR(stepwise_auc({0.1}), 1.0, 1e-12);  // the step at the end counts whole: VOCap, not the true area
  EXPECT_EQ(linear_auc({0.0}), 1.0);
  EXPECT_EQ(linear_auc({kInfinity, 0.1}), 0.0);
}

TEST(PoseAuc, TheTwoAreasAgreeForManyPoses) {
  std::vector<double> errors;
  for (int i = 0; i < 20000; ++i) errors.push_back(0.15 * (i + 0.5) / 20000);
  EXPECT_NEAR(stepwise_auc(errors), linear_auc(errors), 1e-4);
}

TEST(PoseAuc, SharesAndMedians) {
  EXPECT_EQ(share_below({0.01, 0.02, 0.03, kInfinity}, 0.02), 0.25);
  EXPECT_EQ(median_of({3.0, 1.0, 2.0}), 2.0);
  EXPECT_EQ(median_of({4.0, 1.0, 2.0, 3.0}), 2.5);
  EXPECT_EQ(median_of({1.0, kInfinity, kInfinity}), kInfinity);
}

TEST(YcbData, NamesOfTracks) { EXPECT_EQ(object_of_track("0050_003_cracker_box.txt"), "003_cracker_box"); }

TEST(YcbData, ReadsTracksWithMissesAndAnyScaleOfQuaternion) {
  const prescene::tests::ScratchDir scratch;
  const auto file = scratch.path() / "0050_x.txt";
  std::ofstream(file) << "2 0 0 0 0.1 0.2 0.3\n1 0 0 0 0 0 0\n";
  const auto track = read_ycb_track(file);
  ASSERT_TRUE(track.ok()) << track.status().message();
  ASSERT_EQ(track->size(), 2u);
  ASSERT_TRUE((*track)[0].has_value());
  EXPECT_EQ((*track)[0]->rotation.norm(), 1.0);
  EXPECT_EQ((*track)[0]->translation.z(), 0.3);
  EXPECT_FALSE((*track)[1].has_value());
}

TEST(YcbData, NamesThePlaceOfABrokenLine) {
  const prescene::tests::ScratchDir scratch;
  const auto file = scratch.path() / "0050_x.txt";
  for (const char* line : {"1 0 0 0 0 0\n", "1 0 0 0 0 0 x\n", "0 0 0 0 0 0 1\n", "nan 0 0 0 0 0 1\n"}) {
    std::ofstream(file) << "1 0 0 0 0 0 1\n" << line;
    const auto track = read_ycb_track(file);
    ASSERT_FALSE(track.ok()) << line;
    EXPECT_NE(track.status().message().find("line 2"), std::string::npos) << track.status().message();
  }
}

TEST(YcbVideo, SaysWhichFolderIsMissing) {
  const prescene::tests::ScratchDir scratch;
  core::ThreadPool threads(1);
  const auto report = evaluate_ycb_video(scratch.path(), 1, threads);
  ASSERT_FALSE(report.ok());
  EXPECT_EQ(report.status().code(), core::StatusCode::kNotFound);
  EXPECT_NE(report.status().message().find("--data"), std::string::npos) << report.status().message();
}

TEST(YcbVideo, JsonHasTheKeysAndNullForWhatWasNotFound) {
  YcbReport report;
  report.disturbed.n = 280;
  report.disturbed.share_adds_below_2cm = 0.9;
  report.amortised.median_adds_m = kInfinity;
  report.amortised.found = 13;
  report.auc.push_back({"m", "ALL", 1.0, 2.0, 3.0, 4.0});
  const nlohmann::ordered_json json = to_json(report);
  for (const char* section : {"disturbed", "amortised"})
    for (const char* key : {"n", "share_adds_below_2cm", "median_adds_m", "median_add_m", "ms_per_object", "objects"}) {
      EXPECT_TRUE(json[section].contains(key)) << section << " " << key;
      EXPECT_TRUE(json.contains(key)) << key;
    }
  EXPECT_EQ(json["n"], 280);
  EXPECT_TRUE(json["amortised"]["median_adds_m"].is_null());
  EXPECT_EQ(json["amortised"]["found"], 13);
  EXPECT_EQ(json["auc"][0]["expected_adds"], 4.0);
}

}  // namespace
}  // namespace prescene::service
