// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/images/jpeg.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "prescene/interfaces/bytes/file.h"
#include "tests/support/paths.h"

namespace prescene::interfaces {
namespace {

using core::StatusCode;
using geometry::ColorImage;
using testing::HasSubstr;

TEST(Jpeg, ACutImageIsAnErrorNotAHalfGreyPicture) {
  const auto good = encode_jpeg(ColorImage(40, 30, {200, 100, 50}).view());
  ASSERT_TRUE(decode_jpeg(good).ok());
  for (std::size_t length = 0; length + 2 < good.size(); ++length) {
    const auto status = decode_jpeg(std::span(good).first(length)).status();
    EXPECT_FALSE(status.ok()) << length << " of " << good.size();
  }
  EXPECT_THAT(decode_jpeg(std::span(good).first(good.size() - 5)).status().message(), HasSubstr("broken or cut JPEG"));
}

TEST(Jpeg, KeepsToItsLimits) {
  const auto good = encode_jpeg(ColorImage(40, 30).view());
  EXPECT_EQ(decode_jpeg(good, {.max_side = 39}).status().code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(decode_jpeg(good, {.max_pixels = 1199}).status().code(), StatusCode::kResourceExhausted);
  auto claims = good;
  for (std::size_t i = 0; i + 8 < claims.size(); ++i) {
    if (claims[i] != 0xff || claims[i + 1] != 0xc0) continue;
    claims[i + 5] = 0x1f;  // Height 7966,
    claims[i + 7] = 0x1f;  // width 7976.
  }
  EXPECT_THAT(decode_jpeg(claims, {.max_pixels = 1 << 26}).status().message(), HasSubstr("more than its"));
}

TEST(Color, GoesByTheFirstBytesNotTheName) {
  const tests::ScratchDir dir;
  const ColorImage image(4, 4, {1, 2, 3});
  ASSERT_TRUE(write_png(dir.path() / "a.jpg", std::as_const(image).view()).ok());
  EXPECT_EQ(*read_color(dir.path() / "a.jpg"), image);
  ASSERT_TRUE(write_file(dir.path() / "b.png", encode_jpeg(std::as_const(image).view())).ok());
  EXPECT_TRUE(read_color(dir.path() / "b.png").ok());
  ASSERT_TRUE(write_file(dir.path() / "c.png", "BM").ok());
  EXPECT_THAT(read_color(dir.path() / "c.png").status().message(), HasSubstr("c.png: neither a PNG nor a JPEG"));
}

}  // namespace
}  // namespace prescene::interfaces
