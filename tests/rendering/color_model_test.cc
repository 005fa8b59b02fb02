// SPDX-License-Identifier: Apache-2.0
#include "prescene/rendering/sensor/color_model.h"

#include <gtest/gtest.h>

#include <cmath>

namespace prescene::rendering {
namespace {

constexpr geometry::Rgb kRed = {200, 30, 40};
constexpr geometry::Rgb kGreen = {30, 180, 60};
constexpr geometry::Rgb kBlue = {20, 40, 220};

TEST(ColorModel, SpeaksForTheObjectsColoursAndAgainstTheOthers) {
  ColorHistogram object;
  ColorHistogram rest;
  object.add(kRed, 500.0);
  rest.add(kGreen, 90000.0);
  const ColorModel model = make_color_model(object, rest, {});
  EXPECT_NEAR(model(kRed), std::log(20.0), 1e-6);
  EXPECT_NEAR(model(kGreen), -std::log(20.0), 1e-6);
  EXPECT_NEAR(model(kBlue), 0.0, 1e-6) << "a colour seen in neither says nothing, however many pixels were counted";
}

TEST(ColorModel, KnowsNeighbouringBinsAndNotFarOnes) {
  ColorHistogram object;
  object.add(kRed, 100.0);
  const ColorModel model = make_color_model(object, {}, {});
  const geometry::Rgb near_red = {static_cast<std::uint8_t>(kRed[0] + 16), kRed[1], kRed[2]};
  EXPECT_GT(model(near_red), 1.0);
  EXPECT_LT(model(kBlue), -1.0);
}

TEST(ColorModel, SmoothingLosesNoCountAtTheHistogramsEnds) {
  ColorHistogram corner;
  corner.add({255, 255, 255}, 10.0);
  ColorModelOptions options;
  options.smoothing_bins = 2.0;
  options.uniform_share = 0.0;
  options.max_ratio = 1e12;
  const ColorModel model = make_color_model(corner, {}, options);
  double sum = 0.0;
  for (const float log_ratio : model.log_ratio)
    sum += std::exp(static_cast<double>(log_ratio)) / static_cast<double>(model.log_ratio.size());
  EXPECT_NEAR(sum, 1.0, 1e-5);
}

TEST(ColorHistogram, CountsUnderAMask) {
  geometry::ColorImage image(4, 2, kRed);
  geometry::Image<std::uint8_t> mask(4, 2, 0);
  image(1, 1) = kBlue;
  mask(1, 1) = 1;
  mask(2, 0) = 1;
  ColorHistogram inside;
  ColorHistogram outside;
  inside.add(std::as_const(image).view(), std::as_const(mask).view(), 1);
  outside.add(std::as_const(image).view(), std::as_const(mask).view(), 0);
  EXPECT_EQ(inside.total(), 2.0);
  EXPECT_EQ(outside.total(), 6.0);
  EXPECT_EQ(inside.counts()[ColorHistogram::bin(kBlue)], 1.0);
  EXPECT_EQ(outside.counts()[ColorHistogram::bin(kBlue)], 0.0);
}

TEST(ColorModel, WithoutAnyCountsSaysNothing) {
  for (const float log_ratio : make_color_model({}, {}, {}).log_ratio) EXPECT_EQ(log_ratio, 0.0f);
}

}  // namespace
}  // namespace prescene::rendering
