// SPDX-License-Identifier: Apache-2.0
// PNG files laid out by hand from the specification (ISO/IEC 15948), without any library: stored deflate blocks, filter
// 0, checksums bit by bit.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

namespace prescene::tests {

struct PngParts {
  std::uint32_t width = 1;
  std::uint32_t height = 1;
  std::uint8_t bit_depth = 8;
  std::uint8_t color_type = 0;  ///< 0 grey, 2 RGB, 3 palette, 4 grey and alpha, 6 RGBA
  std::uint8_t interlace = 0;
  std::vector<std::uint8_t> palette;    ///< R, G, B of each entry.
  std::vector<std::uint8_t> scanlines;  ///< As stored, each row led by its filter byte.
};

std::vector<std::uint8_t> build_png(const PngParts& parts);
void append_chunk(std::vector<std::uint8_t>* png, std::string_view type, const std::vector<std::uint8_t>& data);

}  // namespace prescene::tests
