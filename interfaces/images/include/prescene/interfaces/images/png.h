// SPDX-License-Identifier: Apache-2.0
// PNG files: colour, depth in 16-bit grey with a scale, and labels in 8- or 16-bit grey or a palette. Sizes are checked
// against limits, and against what the bytes could hold at best, before memory is taken; broken bytes are a status.
//
//   PRESCENE_TRY(geometry::DepthImage depth, read_png_depth(path, 0.001));
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "prescene/core/status.h"
#include "prescene/geometry/image.h"

namespace prescene::interfaces {

using Gray8View = geometry::ImageView<const std::uint8_t>;
using Gray16View = geometry::ImageView<const std::uint16_t>;
using ColorView = geometry::ImageView<const geometry::Rgb>;

/// What an image file may make us allocate.
struct ImageLimits {
  int max_side = 16384;                             ///< Pixels.
  std::int64_t max_pixels = std::int64_t{1} << 24;  ///< 4096 x 4096, as of images in messages.
  std::size_t max_file_bytes = std::size_t{256} << 20;
};

struct ImageSize {
  int width = 0;
  int height = 0;
  friend bool operator==(const ImageSize&, const ImageSize&) = default;
};

// Errors of all readers: those of read_file(); kDataLoss when the bytes are cut or their checksum is wrong,
// kInvalidInput when they are no PNG or of a kind that does not fit, kResourceExhausted above a limit. The read_
// functions begin the text with the path.

/// From the header alone.
core::Result<ImageSize> decode_png_size(std::span<const std::uint8_t> bytes, const ImageLimits& limits = {});
/// 8 bits a channel from any kind of PNG: grey becomes equal channels, 16 bits are rounded to 8, transparency is
/// ignored.
core::Result<geometry::ColorImage> decode_png_color(std::span<const std::uint8_t> bytes,
                                                    const ImageLimits& limits = {});
/// z in metres = value * metres_per_unit from 16-bit grey; 0 and 65535 mean no measurement (0 in the image).
core::Result<geometry::DepthImage> decode_png_depth(std::span<const std::uint8_t> bytes, double metres_per_unit,
                                                    const ImageLimits& limits = {});
/// Values of 16-bit grey as they are.
core::Result<geometry::Image<std::uint16_t>> decode_png_gray16(std::span<const std::uint8_t> bytes,
                                                               const ImageLimits& limits = {});
/// Values of 1- to 16-bit grey, or palette indices, as they are.
core::Result<geometry::LabelImage> decode_png_label(std::span<const std::uint8_t> bytes,
                                                    const ImageLimits& limits = {});

core::Result<ImageSize> read_png_size(const std::filesystem::path& path, const ImageLimits& limits = {});
core::Result<geometry::ColorImage> read_png_color(const std::filesystem::path& path, const ImageLimits& limits = {});
core::Result<geometry::DepthImage> read_png_depth(const std::filesystem::path& path, double metres_per_unit,
                                                  const ImageLimits& limits = {});
core::Result<geometry::LabelImage> read_png_label(const std::filesystem::path& path, const ImageLimits& limits = {});

// Writers. Images must not be empty, sides at most 2^24 (checked). The same image gives the same bytes on the same
// zlib.

std::vector<std::uint8_t> encode_png(ColorView image);
std::vector<std::uint8_t> encode_png(geometry::ImageView<const std::uint8_t> image);
std::vector<std::uint8_t> encode_png(geometry::ImageView<const std::uint16_t> image);
/// 16-bit grey, rounded to the nearest unit; missing depth and what does not fit below 65535 units become 0.
std::vector<std::uint8_t> encode_png_depth(geometry::ImageView<const float> depth, double metres_per_unit);

core::Status write_png(const std::filesystem::path& path, ColorView image);
core::Status write_png(const std::filesystem::path& path, geometry::ImageView<const std::uint8_t> image);
core::Status write_png(const std::filesystem::path& path, geometry::ImageView<const std::uint16_t> image);
core::Status write_png_depth(const std::filesystem::path& path, geometry::ImageView<const float> depth,
                             double metres_per_unit);

}  // namespace prescene::interfaces
