// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <limits>

#include "prescene/core/random.h"
#include "prescene/interfaces/ros_messages/conversions.h"
#include "tests/support/laws.h"

namespace prescene::interfaces {
namespace {

using core::StatusCode;
using geometry::ColorImage;
using geometry::DepthImage;
using testing::HasSubstr;

RosImage image_of(int width, int height, const std::string& encoding, std::vector<std::uint8_t> data,
                  std::uint32_t step) {
  RosImage image;
  image.width = static_cast<std::uint32_t>(width);
  image.height = static_cast<std::uint32_t>(height);
  image.encoding = encoding;
  image.step = step;
  image.data = std::move(data);
  return image;
}

TEST(DepthImages, ReadMillimetresOfEitherByteOrderWithPaddedRows) {
  // 1000, 0 | 65535, 258; two bytes of padding after the first row, none after the last.
  const auto little = image_of(2, 2, "16UC1", {0xe8, 0x03, 0, 0, 9, 9, 0xff, 0xff, 0x02, 0x01}, 6);
  auto big = image_of(2, 2, "16UC1", {0x03, 0xe8, 0, 0, 9, 9, 0xff, 0xff, 0x01, 0x02}, 6);
  big.is_bigendian = 1;
  DepthImageReport report;
  const auto depth = to_depth_image(little, {}, &report);
  ASSERT_TRUE(depth.ok()) << depth.status().message();
  EXPECT_FLOAT_EQ((*depth)(0, 0), 1.0F);
  EXPECT_EQ((*depth)(1, 0), 0.0F);
  EXPECT_EQ((*depth)(0, 1), 0.0F) << "full scale means no measurement";
  EXPECT_FLOAT_EQ((*depth)(1, 1), 0.258F);
  EXPECT_EQ(report.measured, 2);
  EXPECT_EQ(report.missing, 2);
  EXPECT_EQ(*to_depth_image(big), *depth);
}

TEST(DepthImages, TakeNanInfinityZeroAndNegativeAsMissing) {
  const float values[6] = {std::numeric_limits<float>::quiet_NaN(),
                           std::numeric_limits<float>::infinity(),
                           -std::numeric_limits<float>::infinity(),
                           -1.0F,
                           0.0F,
                           0.5F};
  std::vector<std::uint8_t> data(sizeof values);
  std::memcpy(data.data(), values, sizeof values);
  const auto depth = to_depth_image(image_of(6, 1, "32FC1", data, 24));
  ASSERT_TRUE(depth.ok());
  for (int x = 0; x < 5; ++x) EXPECT_EQ((*depth)(x, 0), 0.0F) << x;
  EXPECT_EQ((*depth)(5, 0), 0.5F);
}

TEST(DepthImages, NameTheFieldAndTheRemedy) {
  const std::vector<std::uint8_t> four(4);
  const auto message = [](const RosImage& image) { return to_depth_image(image).status().message(); };
  EXPECT_THAT(message(image_of(0, 2, "16UC1", four, 2)), HasSubstr("width x height: is 0 x 2"));
  EXPECT_THAT(message(image_of(2, 1, "16UC1", four, 3)), HasSubstr("step: 3 is less than a row of 2 pixels"));
  EXPECT_THAT(message(image_of(1, 2, "16UC1", four, 4)), HasSubstr("data: has 4 bytes, but step 4 x height 2"));
  EXPECT_THAT(message(image_of(2, 1, "rgb8", four, 6)), HasSubstr("encoding: 'rgb8' is no depth image; send 16UC1"));
  EXPECT_THAT(message(image_of(2, 1, "mono16", four, 4)), HasSubstr("mono16_is_depth"));
  EXPECT_TRUE(to_depth_image(image_of(2, 1, "mono16", four, 4), {.mono16_is_depth = true}).ok());
  auto odd = image_of(2, 1, "16UC1", four, 4);
  odd.is_bigendian = 7;
  EXPECT_THAT(message(odd), HasSubstr("is_bigendian: is 7"));
  const auto huge = image_of(16385, 1, "16UC1", four, 0xffffffff);
  EXPECT_EQ(to_depth_image(huge).status().code(), StatusCode::kResourceExhausted);
  const auto many = to_depth_image(image_of(4097, 4096, "16UC1", four, 2 * 4097)).status();
  EXPECT_EQ(many.code(), StatusCode::kResourceExhausted);
  EXPECT_THAT(many.message(), HasSubstr("4097 x 4096 exceeds the limit of 16777216 pixels"));
  auto product = image_of(1024, 16384, "16UC1", four, 0xffffffff);  // step * height does not fit in 32 bits.
  EXPECT_THAT(message(product), HasSubstr("data: has 4 bytes"));
}

DepthImage ramp(float first, float slope) {
  DepthImage depth(64, 48);
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 64; ++x) depth(x, y) = first + slope * static_cast<float>(x + y);
  }
  return depth;
}

TEST(DepthImages, DoubtTheUnit) {
  const auto millimetres = to_depth_image(to_ros_image_32fc1(ramp(800.0F, 1.0F), {})).status();
  EXPECT_EQ(millimetres.code(), StatusCode::kInvalidInput);
  EXPECT_THAT(millimetres.message(), HasSubstr("does the sender put millimetres into 32FC1?"));
  EXPECT_TRUE(to_depth_image(to_ros_image_32fc1(ramp(800.0F, 1.0F), {}), {.metres_per_unit_32fc1 = 0.001}).ok());

  DepthImageReport report;
  ASSERT_TRUE(to_depth_image(to_ros_image_16uc1(ramp(0.002F, 0.0F), {}), {}, &report).ok());
  ASSERT_EQ(report.warnings.size(), 1U);
  EXPECT_THAT(report.warnings[0], HasSubstr("is a unit of 0.001 m right"));
  ASSERT_TRUE(to_depth_image(to_ros_image_32fc1(ramp(0.8e-3F, 0.0F), {}), {}, &report).ok());
  EXPECT_THAT(report.warnings, testing::ElementsAre(HasSubstr("is a unit of 1 m right for this sender's 32FC1")));
}

TEST(DepthImages, DoubtTheByteOrder) {
  for (auto image : {to_ros_image_16uc1(ramp(0.8F, 0.003F), {}), to_ros_image_32fc1(ramp(0.8F, 0.003F), {})}) {
    DepthImageReport report;
    ASSERT_TRUE(to_depth_image(image, {}, &report).ok());
    EXPECT_TRUE(report.warnings.empty()) << report.warnings[0];
    image.is_bigendian = 1 - image.is_bigendian;
    const auto depth = to_depth_image(image, {}, &report);
    ASSERT_EQ(report.warnings.size(), 1U) << image.encoding;
    EXPECT_THAT(report.warnings[0], HasSubstr("looks byte-swapped"));
  }
}

TEST(ColorImages, PutTheChannelsInOrder) {
  const geometry::Rgb red_green_blue = {1, 2, 3};
  const auto pixel = [](const char* encoding, std::vector<std::uint8_t> data, std::uint8_t is_bigendian = 0) {
    const auto step = static_cast<std::uint32_t>(data.size());
    auto image = image_of(1, 1, encoding, std::move(data), step);
    image.is_bigendian = is_bigendian;
    return (*to_color_image(image))(0, 0);
  };
  EXPECT_EQ(pixel("rgb8", {1, 2, 3}), red_green_blue);
  EXPECT_EQ(pixel("bgr8", {3, 2, 1}), red_green_blue);
  EXPECT_EQ(pixel("8UC3", {3, 2, 1}), red_green_blue);
  EXPECT_EQ(pixel("rgba8", {1, 2, 3, 9}), red_green_blue);
  EXPECT_EQ(pixel("bgra8", {3, 2, 1, 9}), red_green_blue);
  EXPECT_EQ(pixel("mono8", {7}), (geometry::Rgb{7, 7, 7}));
  EXPECT_EQ(pixel("mono16", {5, 7}), (geometry::Rgb{7, 7, 7}));
  EXPECT_EQ(pixel("mono16", {7, 5}, 1), (geometry::Rgb{7, 7, 7}));
}

TEST(ColorImages, OfEveryPatternOfAGreySurfaceAreGrey) {
  for (const char* pattern : {"bayer_rggb", "bayer_bggr", "bayer_gbrg", "bayer_grbg"}) {
    const std::vector<std::uint8_t> grey(20, 90);
    EXPECT_EQ(*to_color_image(image_of(5, 4, std::string(pattern) + "8", grey, 5)), ColorImage(5, 4, {90, 90, 90}));
    // Rows of 11 bytes; upper byte 90, lower byte 200, in either order.
    for (const bool big_endian : {false, true}) {
      std::vector<std::uint8_t> bytes;
      for (int y = 0; y < 4; ++y) {
        for (int x = 0; x < 10; ++x) bytes.push_back((x % 2 == 0) == big_endian ? 90 : 200);
        if (y < 3) bytes.push_back(7);
      }
      auto image = image_of(5, 4, std::string(pattern) + "16", bytes, 11);
      image.is_bigendian = big_endian ? 1 : 0;
      EXPECT_EQ(*to_color_image(image), ColorImage(5, 4, {90, 90, 90})) << pattern;
    }
  }
}

TEST(ColorImages, OfBayerPatternsKnowRedFromBlue) {
  // A red surface: only the samples of red are bright.
  const struct {
    const char* encoding;
    std::size_t red;
  } patterns[] = {{"bayer_rggb8", 0}, {"bayer_bggr8", 5}, {"bayer_grbg8", 1}, {"bayer_gbrg8", 4}};
  for (const auto& [encoding, red] : patterns) {
    std::vector<std::uint8_t> bytes(16, 0);
    for (const std::size_t offset : {0U, 2U, 8U, 10U}) bytes[red + offset] = 200;
    EXPECT_EQ(*to_color_image(image_of(4, 4, encoding, bytes, 4)), ColorImage(4, 4, {200, 0, 0})) << encoding;
  }
}

// Red of BT.601 is Y 81, U 90, V 240.
TEST(ColorImages, OfYuvKnowTheOrderOfTheirSamples) {
  const auto expect_red = [](const RosImage& image) {
    const auto color = to_color_image(image);
    ASSERT_TRUE(color.ok()) << color.status().message();
    for (std::size_t i = 0; i < color->size(); ++i) {
      EXPECT_NEAR(color->data()[i][0], 254, 1) << image.encoding;
      EXPECT_NEAR(color->data()[i][1], 0, 1) << image.encoding;
      EXPECT_NEAR(color->data()[i][2], 0, 1) << image.encoding;
    }
  };
  for (const char* name : {"yuv422", "uyvy"}) expect_red(image_of(2, 1, name, {90, 81, 240, 81}, 4));
  for (const char* name : {"yuv422_yuy2", "yuyv"}) expect_red(image_of(2, 1, name, {81, 90, 81, 240}, 4));
  expect_red(image_of(2, 2, "nv12", {81, 81, 81, 81, 90, 240}, 2));
  expect_red(image_of(2, 2, "nv21", {81, 81, 81, 81, 240, 90}, 2));
}

TEST(ColorImages, OfSizesThatDoNotFitTheirEncodingAreRefused) {
  const auto message = [](const char* encoding, std::uint32_t width, std::uint32_t height, std::uint32_t step) {
    const auto color = to_color_image(image_of(width, height, encoding, std::vector<std::uint8_t>(64), step));
    EXPECT_EQ(color.status().code(), StatusCode::kInvalidInput) << encoding;
    return color.status().message();
  };
  EXPECT_THAT(message("yuv422", 3, 2, 6), HasSubstr("encoding yuv422: the width of YUV images is even"));
  EXPECT_THAT(message("yuyv", 4, 2, 7), HasSubstr("step: 7 is less than a row of 4 pixels of 'yuyv'"));
  EXPECT_THAT(message("nv12", 3, 2, 4), HasSubstr("the width of YUV images is even"));
  EXPECT_THAT(message("nv21", 4, 3, 4), HasSubstr("the height of YUV 4:2:0 images is even"));
  EXPECT_THAT(message("nv21", 8, 8, 8), HasSubstr("data: has 64 bytes, but step 8 x height 8 of 'nv21' needs 96"));
  EXPECT_THAT(message("bayer_rggb8", 2, 4, 2), HasSubstr("a Bayer image has at least 3 x 3 pixels"));
  EXPECT_THAT(message("bayer_rggb16", 4, 4, 6), HasSubstr("step: 6 is less than a row of 4 pixels"));
  EXPECT_THAT(message("bayer_rggb16", 8, 8, 16), HasSubstr("data: has 64 bytes"));
}

TEST(ColorImages, RefuseOthersByName) {
  const auto bayer = to_color_image(image_of(2, 1, "bayer_rggb8\n", {1, 2}, 2)).status();
  EXPECT_EQ(bayer.code(), StatusCode::kUnsupported);
  EXPECT_THAT(bayer.message(),
              HasSubstr("encoding: 'bayer_rggb8\\x0a' is no colour image that can be read; send one of rgb8"));
  EXPECT_THAT(to_color_image(image_of(2, 2, "nv24", {1, 2}, 2)).status().message(), HasSubstr("nv12, nv21"));
  EXPECT_EQ(to_color_image(image_of(1, 1, "RGB8", {1, 2, 3}, 3)).status().code(), StatusCode::kUnsupported);
  EXPECT_EQ(to_color_image(image_of(2, 2, "rgb8", std::vector<std::uint8_t>(11), 6)).status().code(),
            StatusCode::kInvalidInput);
}

TEST(ImageLaws, GoThereAndBack) {
  EXPECT_TRUE(tests::check_law([](std::uint64_t seed) {
    core::RandomStream stream(seed, core::Purpose::kTest);
    const auto width = static_cast<int>(1 + stream.uniform_below(20));
    const auto height = static_cast<int>(1 + stream.uniform_below(20));
    ColorImage color(width, height);
    DepthImage depth(width, height);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        for (auto& channel : color(x, y)) channel = static_cast<std::uint8_t>(stream.uniform_below(256));
        depth(x, y) = stream.uniform() < 0.2 ? 0.0F : static_cast<float>(stream.uniform(0.1, 60.0));
      }
    }
    RC_ASSERT(*to_color_image(to_ros_image(color, {})) == color);
    RC_ASSERT(*to_depth_image(to_ros_image_32fc1(depth, {})) == depth);
    const DepthImage rounded = *to_depth_image(to_ros_image_16uc1(depth, {}));
    for (std::size_t i = 0; i < depth.size(); ++i) {
      RC_ASSERT(std::abs(rounded.data()[i] - depth.data()[i]) <= 0.000501F);
      RC_ASSERT((rounded.data()[i] == 0.0F) == (depth.data()[i] == 0.0F));
    }
  }));
}

}  // namespace
}  // namespace prescene::interfaces
