// SPDX-License-Identifier: Apache-2.0
// The PNG readers on files laid out by hand.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "png_builder.h"
#include "prescene/interfaces/bytes/file.h"
#include "prescene/interfaces/images/png.h"
#include "tests/support/paths.h"

namespace prescene::interfaces {
namespace {

using core::StatusCode;
using geometry::Rgb;
using testing::HasSubstr;

TEST(Png, ReadsColourOfEveryKind) {
  const auto color = [](const tests::PngParts& parts) { return *decode_png_color(tests::build_png(parts)); };
  const auto rgb = color({2, 1, 8, 2, 0, {}, {0, 1, 2, 3, 4, 5, 6}});
  EXPECT_EQ(rgb(0, 0), (Rgb{1, 2, 3}));
  EXPECT_EQ(rgb(1, 0), (Rgb{4, 5, 6}));
  EXPECT_EQ(color({1, 1, 8, 6, 0, {}, {0, 1, 2, 3, 0}})(0, 0), (Rgb{1, 2, 3})) << "transparent";
  EXPECT_EQ(color({1, 1, 8, 0, 0, {}, {0, 7}})(0, 0), (Rgb{7, 7, 7}));
  EXPECT_EQ(color({1, 1, 8, 4, 0, {}, {0, 7, 99}})(0, 0), (Rgb{7, 7, 7}));
  EXPECT_EQ(color({1, 1, 16, 2, 0, {}, {0, 0xff, 0xff, 0x80, 0x80, 0, 0x10}})(0, 0), (Rgb{255, 128, 0}));
  const auto bits = color({3, 1, 1, 0, 0, {}, {0, 0b10100000}});
  EXPECT_EQ(bits(0, 0), (Rgb{255, 255, 255}));
  EXPECT_EQ(bits(1, 0), (Rgb{0, 0, 0}));
  const auto palette = color({2, 2, 2, 3, 0, {10, 11, 12, 20, 21, 22, 30, 31, 32}, {0, 0b00010000, 0, 0b10000000}});
  EXPECT_EQ(palette(1, 0), (Rgb{20, 21, 22}));
  EXPECT_EQ(palette(0, 1), (Rgb{30, 31, 32}));
}

TEST(Png, ReadsInterlacedRows) {
  // Adam7 of 2 x 2: pass 1 has (0,0), pass 6 has (1,0), pass 7 has row 1.
  const auto depth = decode_png_depth(
      tests::build_png({2, 2, 16, 0, 1, {}, {0, 0x00, 0x01, 0, 0x00, 0x02, 0, 0x01, 0x00, 0x00, 0x04}}), 1.0);
  ASSERT_TRUE(depth.ok()) << depth.status().message();
  EXPECT_EQ((*depth)(0, 0), 1.0F);
  EXPECT_EQ((*depth)(1, 0), 2.0F);
  EXPECT_EQ((*depth)(0, 1), 256.0F);
  EXPECT_EQ((*depth)(1, 1), 4.0F);
}

TEST(Png, ReadsDepthInUnits) {
  const auto png = tests::build_png({3, 1, 16, 0, 0, {}, {0, 0x03, 0xe8, 0, 0, 0xff, 0xff}});
  const auto depth = decode_png_depth(png, 0.0001);
  ASSERT_TRUE(depth.ok());
  EXPECT_FLOAT_EQ((*depth)(0, 0), 0.1F);
  EXPECT_EQ((*depth)(1, 0), 0.0F);
  EXPECT_EQ((*depth)(2, 0), 0.0F) << "full scale means no measurement";
}

TEST(Png, ReadsLabelsAsTheyAre) {
  const auto labels = [](const tests::PngParts& parts) { return *decode_png_label(tests::build_png(parts)); };
  EXPECT_EQ(labels({1, 1, 16, 0, 0, {}, {0, 0x12, 0x34}})(0, 0), 0x1234);
  EXPECT_EQ(labels({1, 1, 8, 0, 0, {}, {0, 200}})(0, 0), 200);
  EXPECT_EQ(labels({2, 1, 4, 0, 0, {}, {0, 0x3f}})(1, 0), 15) << "not stretched to 255";
  EXPECT_EQ(labels({2, 1, 4, 3, 0, {0, 0, 0, 9, 9, 9, 8, 8, 8}, {0, 0x12}})(1, 0), 2) << "palette index";
  EXPECT_THAT(decode_png_label(tests::build_png({1, 1, 8, 2, 0, {}, {0, 1, 2, 3}})).status().message(),
              HasSubstr("8-bit colour, but labels need grey or a palette"));
}

TEST(Png, RefusesWhatIsNoDepth) {
  const auto message = [](const tests::PngParts& parts) {
    return decode_png_depth(tests::build_png(parts), 0.001).status().message();
  };
  EXPECT_THAT(message({1, 1, 8, 2, 0, {}, {0, 1, 2, 3}}), HasSubstr("is 8-bit colour, but depth needs 16-bit grey"));
  EXPECT_THAT(message({1, 1, 8, 0, 0, {}, {0, 1}}), HasSubstr("is 8-bit grey, but depth needs 16-bit grey"));
}

TEST(Png, SaysWhatIsWrongWithTheBytes) {
  const auto good = tests::build_png({2, 1, 8, 2, 0, {}, {0, 1, 2, 3, 4, 5, 6}});
  const auto status = [](const std::vector<std::uint8_t>& bytes, const ImageLimits& limits = {}) {
    return decode_png_color(bytes, limits).status();
  };
  for (std::size_t length = 0; length < good.size(); ++length) {
    const auto cut = status({good.begin(), good.begin() + static_cast<std::ptrdiff_t>(length)});
    EXPECT_EQ(cut.code(), StatusCode::kDataLoss) << length << ": " << cut.message();
  }
  EXPECT_EQ(status({'G', 'I', 'F', '8', '9', 'a'}).code(), StatusCode::kInvalidInput);
  for (std::size_t i = 16; i < good.size(); ++i) {
    auto damaged = good;
    damaged[i] ^= 0x10;
    EXPECT_FALSE(status(damaged).ok()) << i;
  }
  auto bad_crc = good;
  bad_crc[bad_crc.size() - 20] ^= 1;
  EXPECT_THAT(status(bad_crc).message(), HasSubstr("is broken: "));
  EXPECT_EQ(status(good, {.max_side = 1}).code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(status(good, {.max_pixels = 1}).code(), StatusCode::kResourceExhausted);
  EXPECT_THAT(status(tests::build_png({0, 1, 8, 2, 0, {}, {}})).message(), HasSubstr("0 x 1 pixels"));
  EXPECT_EQ(status(tests::build_png({1, 1, 7, 2, 0, {}, {0, 1, 2, 3}})).code(), StatusCode::kDataLoss);
  EXPECT_EQ(status(tests::build_png({1, 1, 8, 5, 0, {}, {0, 1, 2, 3}})).code(), StatusCode::kInvalidInput);
}

TEST(Png, TakesNoMemoryForPixelsThatTheBytesCannotHold) {
  const auto claims = tests::build_png({8000, 8000, 16, 6, 0, {}, {0}});
  const auto status = decode_png_color(claims, {.max_pixels = 1 << 26}).status();
  EXPECT_EQ(status.code(), StatusCode::kDataLoss);
  EXPECT_THAT(status.message(), HasSubstr("says it has 8000 x 8000 pixels, more than its"));
}

TEST(Png, NamesThePath) {
  const tests::ScratchDir dir;
  ASSERT_TRUE(write_file(dir.path() / "a.png", "\x89PNG\r\n\x1a").ok());
  EXPECT_THAT(read_png_color(dir.path() / "a.png").status().message(), HasSubstr("a.png: is cut within its header"));
  EXPECT_EQ(read_png_color(dir.path() / "b.png").status().code(), StatusCode::kNotFound);
}

TEST(Png, ReadsRealFrames) {
  const auto folder = tests::data_dir("ycb_video");
  if (!folder) GTEST_SKIP() << tests::missing_data_message("ycb_video");
  const auto label = read_png_label(*folder / "train-b" / "label.png");
  const auto depth = read_png_depth(*folder / "train-b" / "depth.png", 1e-4);
  ASSERT_TRUE(label.ok() && depth.ok());
  // Objects of the frame: 1 chef can, 3 sugar box, 9 potted meat can, 11 pitcher; all on a table within two metres.
  std::vector<int> seen(22);
  for (std::size_t i = 0; i < label->size(); ++i) {
    ASSERT_LT(label->data()[i], 22);
    ++seen[label->data()[i]];
    ASSERT_LT(depth->data()[i], 6.6F);
  }
  for (int c = 1; c < 22; ++c)
    EXPECT_EQ(seen[static_cast<std::size_t>(c)] > 0, c == 1 || c == 3 || c == 9 || c == 11) << c;
}

}  // namespace
}  // namespace prescene::interfaces
