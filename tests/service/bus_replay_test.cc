// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/live/bus_replay.h"

#include <gtest/gtest.h>

namespace prescene::service {
namespace {

TEST(BusReplay, SaysWhenTheServiceUsedFewOfTheFrames) {
  for (const std::size_t beliefs : {23UL, 24UL, 46UL, 90UL}) EXPECT_EQ(unused_frames_text(46, beliefs), "") << beliefs;
  EXPECT_EQ(unused_frames_text(0, 0), "");
  for (const std::size_t beliefs : {0UL, 3UL, 22UL}) {
    const std::string text = unused_frames_text(46, beliefs);
    EXPECT_NE(text.find(std::to_string(beliefs) + " of 46 frames"), std::string::npos) << text;
    EXPECT_NE(text.find("--speed"), std::string::npos) << text;
  }
}

}  // namespace
}  // namespace prescene::service
