// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "prescene/core/random.h"
#include "prescene/interfaces/images/jpeg.h"
#include "prescene/interfaces/images/png.h"
#include "tests/support/laws.h"

namespace prescene::interfaces {
namespace {

using geometry::ColorImage;
using geometry::DepthImage;
using geometry::Image;

template <class Pixel, class Draw>
Image<Pixel> random_image(core::RandomStream* stream, Draw draw) {
  const int height = static_cast<int>(1 + stream->uniform_below(30));
  Image<Pixel> image(static_cast<int>(1 + stream->uniform_below(30)), height);
  for (std::size_t i = 0; i < image.size(); ++i) image.data()[i] = draw();
  return image;
}

/// A smooth picture, as cameras give, so that JPEG's error stays small.
ColorImage smooth_image(core::RandomStream* stream) {
  const int height = static_cast<int>(8 + stream->uniform_below(60));
  ColorImage image(static_cast<int>(8 + stream->uniform_below(60)), height);
  const double fx = stream->uniform(0.0, 0.1);
  const double fy = stream->uniform(0.0, 0.1);
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      for (std::size_t c = 0; c < 3; ++c) {
        image(x, y)[c] = static_cast<std::uint8_t>(128.0 + 100.0 * std::sin(fx * x + fy * y + static_cast<double>(c)));
      }
    }
  }
  return image;
}

TEST(PngLaws, GoThereAndBack) {
  EXPECT_TRUE(tests::check_law([](std::uint64_t seed) {
    core::RandomStream stream(seed, core::Purpose::kTest);
    const auto byte = [&] { return static_cast<std::uint8_t>(stream.uniform_below(256)); };
    const auto color = random_image<geometry::Rgb>(&stream, [&] { return geometry::Rgb{byte(), byte(), byte()}; });
    RC_ASSERT(*decode_png_color(encode_png(color.view())) == color);
    const auto label =
        random_image<std::uint16_t>(&stream, [&] { return static_cast<std::uint16_t>(stream.next_u32()); });
    RC_ASSERT(*decode_png_label(encode_png(label.view())) == label);
    const auto grey = random_image<std::uint8_t>(&stream, byte);
    const auto grey_back = decode_png_label(encode_png(grey.view()));
    RC_ASSERT(
        std::equal(grey.data(), grey.data() + grey.size(), grey_back->data(), grey_back->data() + grey_back->size()));
  }));
}

TEST(PngLaws, DepthIsKeptWithinHalfAUnit) {
  EXPECT_TRUE(tests::check_law([](std::uint64_t seed) {
    core::RandomStream stream(seed, core::Purpose::kTest);
    const double unit = stream.uniform(1e-4, 1e-2);
    const auto depth = random_image<float>(&stream, [&] {
      return stream.uniform() < 0.2 ? 0.0F : static_cast<float>(stream.uniform(2.0, 60000.0) * unit);
    });
    const auto back = decode_png_depth(encode_png_depth(depth.view(), unit), unit);
    RC_ASSERT(back.ok());
    for (std::size_t i = 0; i < depth.size(); ++i) {
      RC_ASSERT(std::abs(back->data()[i] - depth.data()[i]) <= 0.5005 * unit + 1e-6 * depth.data()[i]);
    }
  }));
}

TEST(PngLaws, AViewOfAPartIsWrittenAsThatPart) {
  Image<std::uint16_t> whole(5, 4);
  for (std::size_t i = 0; i < whole.size(); ++i) whole.data()[i] = static_cast<std::uint16_t>(i);
  const auto part = decode_png_label(encode_png(Gray16View(&std::as_const(whole)(1, 1), 3, 2, whole.width())));
  ASSERT_TRUE(part.ok());
  EXPECT_EQ(part->width(), 3);
  EXPECT_EQ((*part)(2, 1), whole(3, 2));
}

TEST(JpegLaws, ComeBackNearly) {
  EXPECT_TRUE(tests::check_law([](std::uint64_t seed) {
    core::RandomStream stream(seed, core::Purpose::kTest);
    const ColorImage color = smooth_image(&stream);
    const auto back = decode_color(encode_jpeg(color.view(), 95));
    RC_ASSERT(back.ok());
    RC_ASSERT(back->width() == color.width() && back->height() == color.height());
    double sum = 0.0;
    for (std::size_t i = 0; i < color.size(); ++i) {
      for (std::size_t c = 0; c < 3; ++c) sum += std::abs(color.data()[i][c] - back->data()[i][c]);
    }
    RC_ASSERT(sum / static_cast<double>(3 * color.size()) < 3.0);
  }));
}

TEST(ImageLaws, RandomDamageNeverCrashes) {
  EXPECT_TRUE(tests::check_law([](std::uint64_t seed) {
    core::RandomStream stream(seed, core::Purpose::kTest);
    const ColorImage color = smooth_image(&stream);
    for (auto bytes : {encode_png(color.view()), encode_jpeg(color.view(), 80)}) {
      for (int i = 0; i < 4; ++i) {
        bytes[stream.uniform_below(bytes.size())] = static_cast<std::uint8_t>(stream.uniform_below(256));
      }
      bytes.resize(bytes.size() - stream.uniform_below(bytes.size() / 2));
      const auto image = decode_color(bytes, {.max_pixels = 1 << 20});
      RC_ASSERT(image.ok() || !image.status().message().empty());
    }
  }));
}

}  // namespace
}  // namespace prescene::interfaces
