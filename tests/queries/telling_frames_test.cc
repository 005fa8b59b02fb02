// SPDX-License-Identifier: Apache-2.0
#include "prescene/queries/telling_frames.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>

namespace prescene::queries::telling_frames_test {
namespace {

using testing::ElementsAre;
using testing::SizeIs;

WindowFrame frame_of(int camera, float depth, int width = 8) {
  WindowFrame frame;
  frame.observation.camera = camera;
  frame.observation.frame.depth = std::make_shared<const geometry::DepthImage>(width, 6, depth);
  return frame;
}

TEST(TellingFrames, AreOfEveryCameraAndEndWithItsLast) {
  // The first camera sees a wall, the other one, of another resolution, something that comes nearer at the end.
  std::vector<WindowFrame> frames;
  for (int i = 0; i < 12; ++i) {
    frames.push_back(frame_of(0, 1.0F));
    frames.push_back(frame_of(1, i < 9 ? 1.0F : 1.0F - 0.1F * static_cast<float>(i - 8), 16));
  }
  const std::vector<std::size_t> chosen = telling_frames(frames, 8);
  ASSERT_THAT(chosen, SizeIs(8));
  std::vector<std::size_t> of_first, of_second;
  for (const std::size_t i : chosen) (i % 2 == 0 ? of_first : of_second).push_back(i);
  EXPECT_THAT(of_first, ElementsAre(0, testing::_, testing::_, 22));
  EXPECT_THAT(of_second, ElementsAre(1, testing::_, testing::_, 23));
  EXPECT_GE(of_second[2], 19U) << "where it changes";
  EXPECT_THAT(last_of_cameras(frames), ElementsAre(23, 22));
}

TEST(TellingFrames, GivesWhatACameraHasNotToTheOthers) {
  std::vector<WindowFrame> frames;
  frames.push_back(frame_of(1, 1.0F));
  for (int i = 0; i < 20; ++i) frames.push_back(frame_of(0, 1.0F));
  const std::vector<std::size_t> chosen = telling_frames(frames, 6);
  EXPECT_THAT(chosen, SizeIs(6));
  EXPECT_EQ(chosen.front(), 0U);
  EXPECT_EQ(chosen.back(), 20U);
  // More cameras than frames are wanted: those that saw it last.
  std::vector<WindowFrame> many;
  for (int i = 0; i < 9; ++i) many.push_back(frame_of(i, 1.0F));
  EXPECT_THAT(telling_frames(many, 2), ElementsAre(7, 8));
  EXPECT_THAT(telling_frames(std::span(many).first(1), 2), ElementsAre(0));
}

}  // namespace
}  // namespace prescene::queries::telling_frames_test
