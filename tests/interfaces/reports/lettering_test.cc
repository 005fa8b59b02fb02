// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/reports/lettering.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

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

TEST(Lettering, AlignsByItsWidthAndDrawsPlusMinusAsOneLetter) {
  EXPECT_NEAR(text_width("ab", 10.0), text_width("a", 10.0) + text_width("b", 10.0) + 2.4, 1e-9);
  EXPECT_EQ(text_width("\u00b1", 10.0), text_width("+", 10.0));
  EXPECT_EQ(text_width("", 10.0), 0.0);
  ColorImage left(80, 40, kWhite), right(80, 40, kWhite);
  draw_text("abc", {10.0, 30.0}, 12.0, kBlack, left);
  draw_text("abc", {10.0 + text_width("abc", 12.0), 30.0}, 12.0, kBlack, right, TextAlign::kRight);
  EXPECT_EQ(left, right);
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
  fill_rectangle(-5, -5, 100, 2, kBlack, 0.5, picture);
  EXPECT_EQ(picture(10, 1)[0], 128);
}

}  // namespace
}  // namespace prescene::interfaces
