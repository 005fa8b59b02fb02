// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/evaluate/cleargrasp.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/support/paths.h"

namespace prescene::service {
namespace {

constexpr int kWidth = 160;
constexpr int kHeight = 120;
constexpr float kTable = 0.8f;

/// A table seen from above; a square block of 7 cm height, whose upper face is the mask.
ClearGraspFrame made_frame() {
  ClearGraspFrame frame;
  frame.name = "made";
  frame.camera = {kWidth, kHeight, 150.0, 150.0, 79.5, 59.5};
  frame.transparent = geometry::DepthImage(kWidth, kHeight, kTable);
  frame.painted = frame.transparent;
  frame.mask = geometry::LabelImage(kWidth, kHeight, 0);
  for (int y = 40; y < 80; ++y)
    for (int x = 60; x < 100; ++x) {
      frame.mask(x, y) = 255;
      frame.painted(x, y) = kTable - 0.07f;
    }
  return frame;
}

TEST(ClearGrasp, WhatIsSeenThroughSpeaksForTransparency) {
  const ClearGraspScore score = score_cleargrasp(made_frame(), rendering::SensorModel(), 1);
  EXPECT_TRUE(score.knows_plane);
  EXPECT_EQ(score.mask_pixels, 1600);
  // All but pixels so near to the mask's corners that fewer than 24 neighbours are of it.
  EXPECT_GT(score.all.n, 1500);
  EXPECT_EQ(score.behind.n, score.all.n);
  EXPECT_EQ(score.all.share(), 1.0);
  EXPECT_GT(score.all.nats_per_pixel(), 3.0);
  // The painted block returns its own surface.
  EXPECT_EQ(score.painted.n, score.all.n);
  EXPECT_EQ(score.painted.share(), 0.0);
}

TEST(ClearGrasp, MissingReturnsAreCountedApart) {
  ClearGraspFrame frame = made_frame();
  for (int x = 60; x < 100; ++x) frame.transparent(x, 60) = 0.0f;                  // nothing
  for (int x = 60; x < 100; ++x) frame.transparent(x, 61) = frame.painted(x, 61);  // the surface itself
  for (int x = 60; x < 100; ++x) frame.transparent(x, 62) = 0.5f;                  // something in front
  const ClearGraspScore score = score_cleargrasp(frame, rendering::SensorModel(), 1);
  EXPECT_EQ(score.missing.n, 40);
  EXPECT_EQ(score.missing.share(), 1.0);
  EXPECT_EQ(score.at_surface.n, 40);
  EXPECT_EQ(score.at_surface.share(), 0.0);
  EXPECT_EQ(score.in_front.n, 40);
  EXPECT_EQ(score.behind.n, score.all.n - 120);
}

TEST(ClearGrasp, PixelsWithoutAKnownSurfaceAreLeftOut) {
  ClearGraspFrame frame = made_frame();
  for (int y = 40; y < 80; ++y)
    for (int x = 60; x < 80; ++x) frame.painted(x, y) = 0.0f;
  const ClearGraspScore score = score_cleargrasp(frame, rendering::SensorModel(), 1);
  EXPECT_EQ(score.mask_pixels, 1600);
  EXPECT_LT(score.all.n, 900);
  EXPECT_GT(score.all.n, 700);
}

TEST(ClearGrasp, AFolderWithoutFramesIsNamed) {
  const tests::ScratchDir scratch;
  const auto report = evaluate_cleargrasp(scratch.path(), 1);
  ASSERT_FALSE(report.ok());
  EXPECT_NE(report.status().message().find(scratch.path().string()), std::string::npos);
  EXPECT_NE(report.status().message().find("--data"), std::string::npos);
}

}  // namespace
}  // namespace prescene::service
