// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/reports/lettering.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <future>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

namespace prescene::interfaces {
namespace {

using Eigen::Vector2d;
using geometry::ColorImage;
using geometry::Rgb;

constexpr Rgb kWhite = {255, 255, 255}, kBlack = {0, 0, 0};

/// How much black there is, in pixels.
double ink(const ColorImage& picture) {
  double sum = 0.0;
  for (std::size_t i = 0; i < picture.size(); ++i) sum += (255.0 - picture.data()[i][0]) / 255.0;
  return sum;
}

TEST(Lettering, ALineCoversItsLengthTimesItsWidth) {
  for (const double angle : {0.0, 0.3, 0.8, 1.5}) {
    ColorImage picture(200, 200, kWhite);
    const Vector2d along(std::cos(angle), std::sin(angle)), middle(100.0, 100.0);
    const std::array<Vector2d, 2> ends{middle - 60.0 * along, middle + 60.0 * along};
    draw_line(ends, 4.0, kBlack, 1.0, picture);
    EXPECT_NEAR(ink(picture), 120.0 * 4.0 + M_PI * 4.0, 12.0) << angle;  // round ends
  }
}

TEST(Lettering, EveryPrintableLetterHasItsOwnShapeWithinItsWidth) {
  std::vector<ColorImage> seen;
  for (const char letter : std::string("0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz.,:-+%()/_=")) {
    ColorImage picture(60, 60, kWhite);
    const std::string text(1, letter);
    draw_text(text, {15.0, 40.0}, 20.0, kBlack, picture);
    EXPECT_GT(ink(picture), 3.0) << letter;
    const double right = 15.0 + text_width(text, 20.0) + 2.5;
    for (int y = 0; y < 60; ++y)
      for (int x = 0; x < 60; ++x)
        if (x < 12 || x > right) {
          EXPECT_EQ(picture(x, y), kWhite) << letter;
        }
    for (const ColorImage& other : seen) EXPECT_NE(picture, other) << letter;
    seen.push_back(picture);
  }
}

TEST(Lettering, CapitalsStandOnTheirBaseLineAndAreAsHighAsTheySay) {
  for (const double height : {7.0, 10.0, 14.0, 23.0, 80.0}) {
    ColorImage picture(120, 120, kWhite);
    draw_text("I", {20.0, 100.0}, height, kBlack, picture);
    // An I is as wide all along: its ink, over that of a row, is its height.
    double stem = 0.0, row_of_stem = 0.0;
    int lowest = 0;
    for (int y = 0; y < 120; ++y) {
      double row = 0.0;
      for (int x = 0; x < 120; ++x) row += (255.0 - picture(x, y)[0]) / 255.0;
      stem += row;
      if (y == 98) row_of_stem = row;
      if (row > 0.0) lowest = y;
    }
    EXPECT_EQ(lowest, 100) << height;
    EXPECT_NEAR(stem / row_of_stem, height, 0.05 * height) << height;
  }
}

TEST(Lettering, AlignsByItsWidth) {
  EXPECT_NEAR(text_width("ab", 10.0), text_width("a", 10.0) + text_width("b", 10.0), 1e-9);
  EXPECT_NEAR(text_width("ab", 20.0), 2.0 * text_width("ab", 10.0), 0.2);
  EXPECT_EQ(text_width("", 10.0), 0.0);
  ColorImage left(80, 40, kWhite), right(80, 40, kWhite), middle(80, 40, kWhite);
  draw_text("abc", {10.0, 30.0}, 12.0, kBlack, left);
  draw_text("abc", {10.0 + text_width("abc", 12.0), 30.0}, 12.0, kBlack, right, TextAlign::kRight);
  draw_text("abc", {10.0 + 0.5 * text_width("abc", 12.0), 30.0}, 12.0, kBlack, middle, TextAlign::kCenter);
  EXPECT_EQ(left, right);
  EXPECT_EQ(left, middle);
}

TEST(Lettering, DrawsWhatIsNotAscii) {
  const auto drawn = [](std::string_view text) {
    ColorImage picture(80, 40, kWhite);
    draw_text(text, {10.0, 30.0}, 12.0, kBlack, picture);
    return picture;
  };
  EXPECT_NE(drawn("\u00f6"), drawn("o"));
  EXPECT_NE(drawn("\u00b1"), drawn("+"));
  EXPECT_GT(ink(drawn("\u00f6")), ink(drawn("o")));  // two dots more
  EXPECT_EQ(drawn("\xff"), drawn("\ufffd"));
  EXPECT_EQ(drawn("a\xc3"), drawn("a\ufffd"));  // cut
}

TEST(Lettering, AHaloIsAsLightWhereLettersAreCloseAsWhereTheyAreNot) {
  ColorImage picture(80, 40, kBlack);
  draw_label("illi", {10.0, 30.0}, 14.0, kBlack, picture);
  int lightest = 0;
  for (std::size_t i = 0; i < picture.size(); ++i) lightest = std::max(lightest, int{picture.data()[i][0]});
  EXPECT_EQ(lightest, 204);  // 0.8 of white
}

TEST(Lettering, ThreadsDrawTheSameLetters) {
  const auto draw = [] {
    ColorImage picture(200, 40, kWhite);
    for (int i = 0; i < 20; ++i) draw_text("in_bin 62 %", {8.0 * i, 30.0}, 8.0 + i, kBlack, picture);
    return picture;
  };
  const ColorImage alone = draw();
  std::vector<std::future<ColorImage>> others;
  for (int i = 0; i < 4; ++i) others.push_back(std::async(std::launch::async, draw));
  for (std::future<ColorImage>& other : others) EXPECT_EQ(other.get(), alone);
}

TEST(Lettering, WhatIsOutsideOrNoNumberDoesNoHarm) {
  ColorImage picture(20, 20, kWhite);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::array<Vector2d, 5> wild{Vector2d(-1e300, 3.0), Vector2d(nan, 1.0), Vector2d(5.0, 5.0), Vector2d(1e9, 4.0),
                                     Vector2d(8.0, 8.0)};
  draw_line(wild, 2.0, kBlack, 1.0, picture);
  draw_dashed_line(wild, 3.0, 2.0, kBlack, 1.0, picture);
  draw_text("outside", {500.0, -40.0}, 12.0, kBlack, picture);
  draw_text("\xff\xfe", {2.0, 15.0}, 8.0, kBlack, picture);
  draw_text("wild", {nan, 1e300}, 8.0, kBlack, picture);
  draw_text("none", {2.0, 15.0}, 0.0, kBlack, picture);
  draw_text("large", {2.0, 15.0}, 500.0, kBlack, picture);
  fill_rectangle(-5, -5, 100, 2, kBlack, 0.5, picture);
  EXPECT_EQ(picture(10, 1)[0], 128);
}

}  // namespace
}  // namespace prescene::interfaces
