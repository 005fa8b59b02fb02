// SPDX-License-Identifier: Apache-2.0
#include <png.h>

#include <bit>
#include <cmath>
#include <string>

#include "prescene/core/check.h"
#include "prescene/interfaces/bytes/file.h"
#include "prescene/interfaces/images/png.h"

namespace prescene::interfaces {
namespace {

constexpr int kMaxPngSide = 1 << 24;

void append(png_structp png, png_bytep data, std::size_t count) {
  auto* out = static_cast<std::vector<std::uint8_t>*>(png_get_io_ptr(png));
  out->insert(out->end(), data, data + count);
}

// Writing to memory has no outside that could fail: an error is a bug of ours.
[[noreturn]] void on_error(png_structp /*png*/, png_const_charp message) {
  core::check_failed(__FILE__, __LINE__, "libpng writes", message);
}

void on_warning(png_structp /*png*/, png_const_charp /*message*/) {}

template <class Pixel>
std::vector<std::uint8_t> encode(geometry::ImageView<const Pixel> image, int color_type, int bit_depth) {
  PRESCENE_CHECK(image.width() > 0 && image.width() <= kMaxPngSide && image.height() > 0 &&
                 image.height() <= kMaxPngSide);
  std::vector<std::uint8_t> out;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, on_error, on_warning);
  PRESCENE_CHECK(png != nullptr);
  png_infop info = png_create_info_struct(png);
  PRESCENE_CHECK(info != nullptr);
  png_set_write_fn(png, &out, append, nullptr);
  png_set_user_limits(png, kMaxPngSide, kMaxPngSide);
  png_set_IHDR(png, info, static_cast<png_uint_32>(image.width()), static_cast<png_uint_32>(image.height()), bit_depth,
               color_type, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_write_info(png, info);
  if (bit_depth == 16 && std::endian::native == std::endian::little) png_set_swap(png);
  for (int y = 0; y < image.height(); ++y) png_write_row(png, reinterpret_cast<png_const_bytep>(image.row(y)));
  png_write_end(png, info);
  png_destroy_write_struct(&png, &info);
  return out;
}

}  // namespace

std::vector<std::uint8_t> encode_png(ColorView image) { return encode(image, PNG_COLOR_TYPE_RGB, 8); }
std::vector<std::uint8_t> encode_png(Gray8View image) { return encode(image, PNG_COLOR_TYPE_GRAY, 8); }
std::vector<std::uint8_t> encode_png(Gray16View image) { return encode(image, PNG_COLOR_TYPE_GRAY, 16); }

std::vector<std::uint8_t> encode_png_depth(geometry::ImageView<const float> depth, double metres_per_unit) {
  PRESCENE_CHECK(metres_per_unit > 0.0 && std::isfinite(metres_per_unit));
  geometry::Image<std::uint16_t> units(depth.width(), depth.height());
  for (int y = 0; y < depth.height(); ++y) {
    for (int x = 0; x < depth.width(); ++x) {
      const double value = std::round(static_cast<double>(depth(x, y)) / metres_per_unit);
      units(x, y) = value >= 1.0 && value < 65535.0 ? static_cast<std::uint16_t>(value) : std::uint16_t{0};
    }
  }
  return encode_png(std::as_const(units).view());
}

core::Status write_png(const std::filesystem::path& path, ColorView image) {
  return write_file(path, encode_png(image));
}
core::Status write_png(const std::filesystem::path& path, Gray8View image) {
  return write_file(path, encode_png(image));
}
core::Status write_png(const std::filesystem::path& path, Gray16View image) {
  return write_file(path, encode_png(image));
}

core::Status write_png_depth(const std::filesystem::path& path, geometry::ImageView<const float> depth,
                             double metres_per_unit) {
  return write_file(path, encode_png_depth(depth, metres_per_unit));
}

}  // namespace prescene::interfaces
