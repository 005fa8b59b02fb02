// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/images/raw_color.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "prescene/core/random.h"

namespace prescene::interfaces::raw_color_test {
namespace {

using geometry::ColorImage;
using geometry::Rgb;
using testing::HasSubstr;
using Bytes = std::vector<std::uint8_t>;

Rgb pixel(const Bytes& bytes, RawColor form, int x = 0) {
  const int width = form == RawColor::kUyvy || form == RawColor::kYuyv ? 2 : 1;
  const auto color = to_color({bytes, width, 1, bytes.size()}, form);
  EXPECT_TRUE(color.ok()) << color.status().message();
  return (*color)(x, 0);
}

Bytes noise(std::size_t size) {
  core::RandomStream stream(7, core::Purpose::kTest);
  Bytes bytes(size);
  for (auto& byte : bytes) byte = static_cast<std::uint8_t>(stream.uniform_below(256));
  return bytes;
}

TEST(RawColor, PicksTheBytesOfEachColour) {
  EXPECT_EQ(pixel({1, 2, 3}, RawColor::kRgb), (Rgb{1, 2, 3}));
  EXPECT_EQ(pixel({1, 2, 3}, RawColor::kBgr), (Rgb{3, 2, 1}));
  EXPECT_EQ(pixel({1, 2, 3, 4}, RawColor::kRgba), (Rgb{1, 2, 3}));
  EXPECT_EQ(pixel({1, 2, 3, 4}, RawColor::kBgra), (Rgb{3, 2, 1}));
  EXPECT_EQ(pixel({9}, RawColor::kGrey), (Rgb{9, 9, 9}));
}

TEST(RawColor, ReadsPaddedRowsAndALastRowWithoutPadding) {
  const Bytes bytes = {1, 2, 3, 4, 5, 6, 0, 7, 8, 9, 10, 11, 12};
  for (const RawColor form : {RawColor::kRgb, RawColor::kBgr}) {
    const ColorImage color = *to_color({bytes, 2, 2, 7}, form);
    const bool rgb = form == RawColor::kRgb;
    EXPECT_EQ(color(1, 0), (rgb ? Rgb{4, 5, 6} : Rgb{6, 5, 4}));
    EXPECT_EQ(color(1, 1), (rgb ? Rgb{10, 11, 12} : Rgb{12, 11, 10}));
  }
}

/// BT.601 of limited range, as ITU-R BT.601 writes it.
Rgb bt601(int y, int u, int v) {
  const auto byte = [](double value) { return static_cast<std::uint8_t>(std::clamp(std::round(value), 0.0, 255.0)); };
  const double luma = 255.0 / 219.0 * std::max(0, y - 16);
  const double cb = 255.0 / 224.0 * (u - 128);
  const double cr = 255.0 / 224.0 * (v - 128);
  return {byte(luma + 1.402 * cr), byte(luma - 0.344136 * cb - 0.714136 * cr), byte(luma + 1.772 * cb)};
}

void expect_near(const Rgb& a, const Rgb& b) {
  for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(a[c], b[c], 1.0);
}

TEST(RawColor, OfYuvIsThatOfBt601) {
  const Bytes bytes = noise(4 * 1000);
  for (std::size_t i = 0; i < bytes.size(); i += 4) {
    const Bytes group(bytes.begin() + static_cast<std::ptrdiff_t>(i),
                      bytes.begin() + static_cast<std::ptrdiff_t>(i + 4));
    for (const int x : {0, 1}) {
      expect_near(pixel(group, RawColor::kUyvy, x), bt601(group[x == 0 ? 1 : 3], group[0], group[2]));
      expect_near(pixel(group, RawColor::kYuyv, x), bt601(group[x == 0 ? 0 : 2], group[1], group[3]));
    }
  }
}

TEST(RawColor, OfYuv420TakesTheColoursOfTwoByTwoPixels) {
  const int width = 6;
  const int height = 4;
  const int step = 7;  // padded
  const Bytes bytes = noise(step * 6 - 1);
  for (const RawColor form : {RawColor::kNv12, RawColor::kNv21}) {
    const ColorImage color = *to_color({bytes, width, height, step}, form);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const auto at = [&](int column, int row) { return bytes[static_cast<std::size_t>(row * step + column)]; };
        const int first = at(x / 2 * 2, height + y / 2);
        const int second = at(x / 2 * 2 + 1, height + y / 2);
        const bool u_first = form == RawColor::kNv12;
        expect_near(color(x, y), bt601(at(x, y), u_first ? first : second, u_first ? second : first));
      }
    }
  }
}

/// Bilinear, in the interior: each missing colour is the mean of the two or four neighbours that have it.
TEST(RawColor, OfBayerPatternsIsTheMeanOfTheNearestSamples) {
  const int width = 9;
  const int height = 7;
  const Bytes bytes = noise(static_cast<std::size_t>(width * height));
  const struct {
    RawColor form;
    std::size_t colour[2][2];
  } patterns[] = {{RawColor::kBayerRggb, {{0, 1}, {1, 2}}},
                  {RawColor::kBayerBggr, {{2, 1}, {1, 0}}},
                  {RawColor::kBayerGbrg, {{1, 2}, {0, 1}}},
                  {RawColor::kBayerGrbg, {{1, 0}, {2, 1}}}};
  for (const auto& pattern : patterns) {
    const ColorImage color = *to_color({bytes, width, height, width}, pattern.form);
    for (int y = 1; y < height - 1; ++y) {
      for (int x = 1; x < width - 1; ++x) {
        EXPECT_EQ(color(x, y)[pattern.colour[y % 2][x % 2]], bytes[static_cast<std::size_t>(y * width + x)]);
        double sum[3] = {};
        int count[3] = {};
        for (int dy = -1; dy <= 1; ++dy) {
          for (int dx = -1; dx <= 1; ++dx) {
            const std::size_t c = pattern.colour[(y + dy) % 2][(x + dx) % 2];
            // Green has its nearest samples beside it, not across the corner.
            if (c == 1 && dx != 0 && dy != 0) continue;
            sum[c] += bytes[static_cast<std::size_t>((y + dy) * width + x + dx)];
            ++count[c];
          }
        }
        for (std::size_t c = 0; c < 3; ++c) {
          if (c == pattern.colour[y % 2][x % 2]) continue;
          EXPECT_NEAR(color(x, y)[c], sum[c] / count[c], 0.5 + 1e-9);
        }
      }
    }
  }
}

TEST(RawColor, OfAGreySurfaceIsGreyInEveryBayerPatternUpToTheBorder) {
  for (const int side : {3, 4, 5, 8}) {
    const Bytes grey(static_cast<std::size_t>(side * side), 77);
    for (const RawColor form :
         {RawColor::kBayerRggb, RawColor::kBayerBggr, RawColor::kBayerGbrg, RawColor::kBayerGrbg}) {
      EXPECT_EQ(*to_color({grey, side, side, static_cast<std::size_t>(side)}, form),
                ColorImage(side, side, {77, 77, 77}));
    }
  }
}

TEST(RawColor, TakesTheFirstByteOfLongerSamples) {
  const Bytes bytes = {7, 255, 8, 255, 0, 9, 255, 10};  // the last byte is never needed
  const ColorImage grey = *to_color({bytes, 2, 2, 5, 2}, RawColor::kGrey);
  EXPECT_EQ(grey(1, 0), (Rgb{8, 8, 8}));
  EXPECT_EQ(grey(1, 1), (Rgb{10, 10, 10}));
}

TEST(RawColor, RefusesSizesThatDoNotFitTheForm) {
  const Bytes bytes(1000);
  const auto message = [&](int width, int height, std::size_t step, RawColor form) {
    const auto color = to_color({bytes, width, height, step}, form);
    EXPECT_FALSE(color.ok());
    return color.status().message();
  };
  EXPECT_THAT(message(5, 4, 10, RawColor::kUyvy), HasSubstr("the width of YUV images is even"));
  EXPECT_THAT(message(5, 4, 5, RawColor::kNv12), HasSubstr("the width of YUV images is even"));
  EXPECT_THAT(message(4, 5, 4, RawColor::kNv21), HasSubstr("the height of YUV 4:2:0 images is even"));
  EXPECT_THAT(message(2, 8, 2, RawColor::kBayerRggb), HasSubstr("at least 3 x 3 pixels; this one has 2 x 8"));
  EXPECT_THAT(message(4, 4, 7, RawColor::kYuyv), HasSubstr("rows of 7 bytes"));
  EXPECT_THAT(message(30, 30, 30, RawColor::kNv12), HasSubstr("1000 bytes in all are too few"));
  EXPECT_THAT(message(0, 4, 7, RawColor::kRgb), HasSubstr("is empty"));
}

}  // namespace
}  // namespace prescene::interfaces::raw_color_test
