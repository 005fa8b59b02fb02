// SPDX-License-Identifier: Apache-2.0
// Colour images from the forms in which cameras deliver them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "prescene/core/status.h"
#include "prescene/geometry/image.h"

namespace prescene::interfaces {

enum class RawColor {
  kRgb,        ///< 3 bytes a pixel
  kBgr,        ///< 3 bytes a pixel
  kRgba,       ///< 4 bytes a pixel; the last is ignored
  kBgra,       ///< 4 bytes a pixel; the last is ignored
  kGrey,       ///< 1 byte a pixel
  kBayerRggb,  ///< 1 byte a pixel: the colours of the first two pixels of the first row, then of the second
  kBayerBggr,
  kBayerGbrg,
  kBayerGrbg,
  kUyvy,  ///< YUV 4:2:2, 2 bytes a pixel: U Y V Y for two pixels
  kYuyv,  ///< YUV 4:2:2, 2 bytes a pixel: Y U Y V for two pixels
  kNv12,  ///< YUV 4:2:0: rows of Y, then half as many rows of U V pairs
  kNv21,  ///< YUV 4:2:0: rows of Y, then half as many rows of V U pairs
};

/// What a form asks of sizes.
struct RawColorLayout {
  int bytes_per_pixel = 1;  ///< In a row.
  bool even_width = false;
  bool even_height = false;
  int min_side = 1;            ///< 3 for Bayer patterns: at the border the colours come from the next row inwards.
  bool has_half_rows = false;  ///< Half as many rows again follow, of the same step.
};
RawColorLayout layout_of(RawColor form);

/// Bytes of an image; does not own them.
struct RawColorView {
  std::span<const std::uint8_t> bytes;
  int width = 0;
  int height = 0;
  std::size_t step = 0;  ///< Bytes from one row to the next.
  /// Bytes of each sample, of which only the first is used, at `bytes`. 2 for samples of 16 bits, not for YUV.
  int sample_bytes = 1;
};

/// Bayer patterns are interpolated bilinearly. YUV is that of ITU-R BT.601 with its limited range (Y from 16 to 235),
/// as in cv_bridge. kInvalidInput when the size or the bytes do not fit the layout; the message names which.
core::Result<geometry::ColorImage> to_color(const RawColorView& image, RawColor form);

}  // namespace prescene::interfaces
