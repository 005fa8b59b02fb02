// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/images/rvl.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "prescene/core/random.h"
#include "tests/interfaces/images/rvl_coder.h"

namespace prescene::interfaces::rvl_test {
namespace {

using core::StatusCode;
using testing::HasSubstr;

std::vector<std::uint16_t> pixels_of(const geometry::Image<std::uint16_t>& image) {
  return {image.data(), image.data() + image.size()};
}

// Pixels and code of the published coder.
const std::vector<std::uint16_t> kPixels = {0, 0, 0, 1000, 1001, 999, 0, 65535, 1, 0, 0, 5};
const std::vector<std::uint8_t> kCode = {0x23, 0xf3, 0x8a, 0x33, 0xf3, 0x8c, 0x8e, 0x12,
                                         0x21, 0xf3, 0xff, 0xbf, 0x00, 0x00, 0x00, 0x81};

TEST(Rvl, DecodesThePublishedCode) {
  const auto image = decode_rvl(kCode, {4, 3});
  ASSERT_TRUE(image.ok()) << image.status().message();
  EXPECT_EQ(image->width(), 4);
  EXPECT_EQ(image->height(), 3);
  EXPECT_EQ(pixels_of(*image), kPixels);
  EXPECT_EQ(tests::rvl_code(kPixels), kCode) << "of the tests' own coder";
}

TEST(Rvl, GivesBackWhatWasCoded) {
  core::RandomStream stream(7, core::Purpose::kTest);
  for (int i = 0; i < 200; ++i) {
    const ImageSize size{static_cast<int>(1 + stream.uniform_below(40)),
                         static_cast<int>(1 + stream.uniform_below(40))};
    std::vector<std::uint16_t> pixels(static_cast<std::size_t>(size.width * size.height));
    const std::uint64_t holes = stream.uniform_below(4);  // of four pixels, those without depth
    const std::uint64_t range = i % 2 == 0 ? 65536 : 20;
    for (std::uint16_t& pixel : pixels)
      pixel =
          stream.uniform_below(4) < holes ? std::uint16_t{0} : static_cast<std::uint16_t>(stream.uniform_below(range));
    const auto image = decode_rvl(tests::rvl_code(pixels), size);
    ASSERT_TRUE(image.ok()) << image.status().message();
    ASSERT_EQ(pixels_of(*image), pixels);
  }
}

TEST(Rvl, AnEmptyImageTakesOneWord) {
  const std::vector<std::uint16_t> nothing(640 * 480, 0);
  const auto code = tests::rvl_code(nothing);
  EXPECT_EQ(code.size(), 4U) << "307200 in seven digits, and a 0";
  const auto image = decode_rvl(code, {640, 480});
  ASSERT_TRUE(image.ok());
  EXPECT_EQ(pixels_of(*image), nothing);
}

TEST(Rvl, RefusesACutCode) {
  for (std::size_t length = 0; length < kCode.size(); ++length) {
    const auto image = decode_rvl(std::span(kCode).first(length), {4, 3});
    EXPECT_EQ(image.status().code(), StatusCode::kDataLoss) << length;
  }
}

TEST(Rvl, RefusesSizesThatAreNotThoseOfTheCode) {
  EXPECT_EQ(decode_rvl(kCode, {4, 4}).status().code(), StatusCode::kDataLoss) << "the code ends before the image";
  EXPECT_THAT(decode_rvl(kCode, {4, 2}).status().message(), HasSubstr("more pixels than the 8"));
  // The first word ends with pixel 6; the other three are left over.
  EXPECT_THAT(decode_rvl(kCode, {6, 1}).status().message(), HasSubstr("12 bytes are left over"));
  EXPECT_EQ(decode_rvl(kCode, {0, 3}).status().code(), StatusCode::kInvalidInput);
  EXPECT_EQ(decode_rvl(kCode, {-4, 3}).status().code(), StatusCode::kInvalidInput);
}

TEST(Rvl, RefusesRunsAndNumbersBeyondAllImages) {
  // A run of 2^32 - 1 zeros, and a number of twelve digits: 0xf...
  const std::vector<std::uint8_t> long_run = tests::rvl_words({0xffffffff, 0});
  EXPECT_EQ(decode_rvl(long_run, {4, 3}).status().code(), StatusCode::kDataLoss);
  EXPECT_EQ(decode_rvl(std::vector<std::uint8_t>(64, 0xff), {4, 3}).status().code(), StatusCode::kDataLoss);
  EXPECT_EQ(decode_rvl(std::vector<std::uint8_t>(64, 0x00), {4, 3}).status().code(), StatusCode::kDataLoss)
      << "runs of nothing";
}

TEST(Rvl, TakesNoMemoryForImagesBeyondTheLimits) {
  EXPECT_EQ(decode_rvl(kCode, {20000, 3}).status().code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(decode_rvl(kCode, {16384, 16384}).status().code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(decode_rvl(kCode, {4, 3}, {.max_pixels = 11}).status().code(), StatusCode::kResourceExhausted);
}

}  // namespace
}  // namespace prescene::interfaces::rvl_test
