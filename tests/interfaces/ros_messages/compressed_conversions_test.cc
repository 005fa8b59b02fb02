// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <utility>

#include "prescene/interfaces/images/jpeg.h"
#include "prescene/interfaces/images/png.h"
#include "prescene/interfaces/ros_messages/conversions.h"
#include "tests/interfaces/images/rvl_coder.h"

namespace prescene::interfaces::compressed_conversions_test {
namespace {

using core::StatusCode;
using geometry::Image;
using testing::HasSubstr;

using Bytes = std::vector<std::uint8_t>;

/// The header of compressedDepth: which quantisation, and its two parameters.
Bytes with_header(float a, float b, const Bytes& payload) {
  Bytes bytes(12, 0);
  std::memcpy(bytes.data() + 4, &a, sizeof a);
  std::memcpy(bytes.data() + 8, &b, sizeof b);
  bytes.insert(bytes.end(), payload.begin(), payload.end());
  return bytes;
}

Bytes little_endian(std::uint32_t value) {
  return {static_cast<std::uint8_t>(value), static_cast<std::uint8_t>(value >> 8U),
          static_cast<std::uint8_t>(value >> 16U), static_cast<std::uint8_t>(value >> 24U)};
}

Bytes rvl_payload(std::uint32_t columns, std::uint32_t rows, const std::vector<std::uint16_t>& pixels) {
  Bytes bytes = little_endian(columns);
  for (const Bytes& part : {little_endian(rows), tests::rvl_code(pixels)})
    bytes.insert(bytes.end(), part.begin(), part.end());
  return bytes;
}

Bytes gray_png(int width, int height, const std::vector<std::uint16_t>& pixels) {
  Image<std::uint16_t> image(width, height);
  std::copy(pixels.begin(), pixels.end(), image.data());
  return encode_png(std::as_const(image).view());
}

RosCompressedImage message(const std::string& format, Bytes data) {
  RosCompressedImage image;
  image.format = format;
  image.data = std::move(data);
  return image;
}

const std::vector<std::uint16_t> kMillimetres = {0, 500, 1000, 1500, 65535, 2000};

TEST(CompressedDepth, ReadsMillimetresFromPngAndRvl) {
  const Bytes png = gray_png(3, 2, kMillimetres);
  const Bytes rvl = rvl_payload(3, 2, kMillimetres);
  const float garbage = std::numeric_limits<float>::quiet_NaN();  // senders leave the parameters unset for 16UC1
  for (const RosCompressedImage& image :
       {message("16UC1; compressedDepth", with_header(garbage, garbage, png)),
        message("16UC1; compressedDepth png", with_header(0, 0, png)),
        message("16UC1; compressedDepth rvl", with_header(0, 0, rvl)), message("16UC1; png compressed ", png),
        message("png", png), message("", png)}) {
    DepthImageReport report;
    const auto depth = to_depth_image(image, {}, &report);
    ASSERT_TRUE(depth.ok()) << image.format << ": " << depth.status().message();
    ASSERT_EQ(depth->width(), 3);
    ASSERT_EQ(depth->height(), 2);
    const std::vector<float> metres = {0.0F, 0.5F, 1.0F, 1.5F, 0.0F, 2.0F};
    for (std::size_t i = 0; i < metres.size(); ++i) EXPECT_FLOAT_EQ(depth->data()[i], metres[i]) << image.format;
    EXPECT_EQ(report.measured, 4);
    EXPECT_EQ(report.missing, 2);
  }
}

TEST(CompressedDepth, ReadsInverseDepthWithTheParametersOfTheMessage) {
  // With a quantum of 100 and a largest depth of 10 m: a = 100 * 101 = 10100, b = 1 - a / 10 = -1009. 1 m is coded as
  // a / 1 + b = 9091, 2 m as 5050 - 1009 = 4041, 0.25 m as 40400 - 1009 = 39391.
  const std::vector<std::uint16_t> codes = {0, 9091, 4041, 39391};
  const Bytes png = gray_png(2, 2, codes);
  for (const RosCompressedImage& image :
       {message("32FC1; compressedDepth png", with_header(10100.0F, -1009.0F, png)),
        message("32FC1; compressedDepth rvl", with_header(10100.0F, -1009.0F, rvl_payload(2, 2, codes)))}) {
    const auto depth = to_depth_image(image);
    ASSERT_TRUE(depth.ok()) << depth.status().message();
    EXPECT_EQ((*depth)(0, 0), 0.0F);
    EXPECT_FLOAT_EQ((*depth)(1, 0), 1.0F);
    EXPECT_FLOAT_EQ((*depth)(0, 1), 2.0F);
    EXPECT_FLOAT_EQ((*depth)(1, 1), 0.25F);
  }
}

TEST(CompressedDepth, TakesCodesWithoutADepthAsMissing) {
  // a / (code - b) with b = 4041 divides by 0 for the first code and is negative for the second.
  const std::vector<std::uint16_t> codes = {4041, 4000, 4141, 0};
  const auto depth =
      to_depth_image(message("32FC1; compressedDepth rvl", with_header(100.0F, 4041.0F, rvl_payload(2, 2, codes))));
  ASSERT_TRUE(depth.ok()) << depth.status().message();
  EXPECT_EQ((*depth)(0, 0), 0.0F);
  EXPECT_EQ((*depth)(1, 0), 0.0F);
  EXPECT_FLOAT_EQ((*depth)(0, 1), 1.0F);
  EXPECT_EQ((*depth)(1, 1), 0.0F);
}

TEST(CompressedDepth, RefusesWhatHoldsNoDepth) {
  const geometry::ColorImage color(8, 8, {10, 20, 30});
  const Bytes jpeg = encode_jpeg(color.view());
  const Bytes color_png = encode_png(color.view());
  const Bytes png = gray_png(3, 2, kMillimetres);
  const auto text = [](const RosCompressedImage& image) { return to_depth_image(image).status().message(); };
  EXPECT_THAT(text(message("mono16; jpeg compressed ", jpeg)), HasSubstr("does not keep depth"));
  EXPECT_THAT(text(message("16UC1; png compressed ", color_png)), HasSubstr("depth needs 16-bit grey"));
  EXPECT_THAT(text(message("16UC1; compressedDepth png", with_header(0, 0, color_png))), HasSubstr("16-bit grey"));
  EXPECT_THAT(text(message("16UC1; compressedDepth zstd", with_header(0, 0, {1, 2, 3}))),
              HasSubstr("names no other coding"));
  EXPECT_THAT(text(message("rgb8; compressedDepth png", with_header(0, 0, png))),
              HasSubstr("'rgb8' is no depth image"));
  EXPECT_THAT(text(message("32FC1; png compressed ", png)), HasSubstr("can't hold 32FC1"));
  EXPECT_THAT(text(message("16UC1; compressedDepth", Bytes(11, 0))), HasSubstr("within its header of 12 bytes"));
  EXPECT_THAT(text(message("16UC1; compressedDepth", Bytes(12, 0))), HasSubstr("is empty"));
  EXPECT_THAT(text(message("16UC1; compressedDepth rvl", with_header(0, 0, {1, 0, 0}))), HasSubstr("within the size"));
  for (const float a : {0.0F, -1.0F, std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()})
    EXPECT_THAT(text(message("32FC1; compressedDepth png", with_header(a, 0.0F, png))), HasSubstr("which is no depth"));
}

TEST(CompressedDepth, RefusesCutAndLyingImages) {
  const Bytes png = gray_png(3, 2, kMillimetres);
  const Bytes whole = with_header(0, 0, png);
  for (std::size_t length = 0; length < whole.size(); ++length) {
    const Bytes cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(length));
    EXPECT_FALSE(to_depth_image(message("16UC1; compressedDepth png", cut)).ok()) << length;
  }
  const auto code = [](const RosCompressedImage& image) { return to_depth_image(image).status().code(); };
  // Sizes that no memory should be taken for.
  EXPECT_EQ(
      code(message("16UC1; compressedDepth rvl", with_header(0, 0, rvl_payload(0xffffffff, 0xffffffff, kMillimetres)))),
      StatusCode::kResourceExhausted);
  EXPECT_EQ(code(message("16UC1; compressedDepth rvl", with_header(0, 0, rvl_payload(16384, 16384, kMillimetres)))),
            StatusCode::kResourceExhausted);
  EXPECT_EQ(code(message("16UC1; compressedDepth rvl", with_header(0, 0, rvl_payload(3, 3, kMillimetres)))),
            StatusCode::kDataLoss);
  Bytes huge = png;
  huge[16] = 0x3f;  // the first byte of the width
  EXPECT_EQ(code(message("16UC1; compressedDepth png", with_header(0, 0, huge))), StatusCode::kResourceExhausted);
}

TEST(CompressedColor, IsReadWhateverTheFormatSays) {
  geometry::ColorImage color(16, 12);
  for (int y = 0; y < 12; ++y)
    for (int x = 0; x < 16; ++x) color(x, y) = {200, static_cast<std::uint8_t>(8 * x), 40};
  const auto png = to_color_image(message("bgr8; jpeg compressed bgr8", encode_png(std::as_const(color).view())));
  ASSERT_TRUE(png.ok()) << png.status().message();
  EXPECT_EQ(*png, color);
  const auto jpeg = to_color_image(message("png", encode_jpeg(std::as_const(color).view(), 95)));
  ASSERT_TRUE(jpeg.ok()) << jpeg.status().message();
  for (std::size_t i = 0; i < color.size(); ++i)
    for (std::size_t c = 0; c < 3; ++c) ASSERT_NEAR(jpeg->data()[i][c], color.data()[i][c], 12) << i;
}

TEST(CompressedColor, RefusesCutBytesAndBombs) {
  const geometry::ColorImage color(64, 64, {10, 200, 30});
  for (const Bytes& whole : {encode_jpeg(color.view()), encode_png(color.view())}) {
    for (std::size_t length = 0; length + 12 < whole.size(); length += 7) {
      const Bytes cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(length));
      EXPECT_FALSE(to_color_image(message("jpeg", cut)).ok()) << length;
    }
  }
  EXPECT_THAT(to_color_image(message("h264", {0, 0, 0, 1, 9})).status().message(), HasSubstr("'h264'"));
  const auto limited = to_color_image(message("jpeg", encode_jpeg(color.view())), {.max_pixels = 1000});
  EXPECT_EQ(limited.status().code(), StatusCode::kResourceExhausted);
}

}  // namespace
}  // namespace prescene::interfaces::compressed_conversions_test
