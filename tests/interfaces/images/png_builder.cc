// SPDX-License-Identifier: Apache-2.0
#include "png_builder.h"

namespace prescene::tests {
namespace {

std::uint32_t bitwise_crc(const std::vector<std::uint8_t>& bytes) {
  std::uint32_t crc = 0xffffffffU;
  for (const std::uint8_t byte : bytes) {
    crc ^= byte;
    for (int i = 0; i < 8; ++i) crc = (crc & 1U) != 0 ? crc >> 1 ^ 0xedb88320U : crc >> 1;
  }
  return ~crc;
}

void append_big_endian(std::vector<std::uint8_t>* out, std::uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) out->push_back(static_cast<std::uint8_t>(value >> shift));
}

/// One stored block in a zlib stream; at most 65535 bytes.
std::vector<std::uint8_t> stored(const std::vector<std::uint8_t>& data) {
  const auto size = static_cast<std::uint16_t>(data.size());
  std::vector<std::uint8_t> out = {0x78, 0x01, 0x01};
  for (const std::uint16_t word : {size, static_cast<std::uint16_t>(~size)}) {
    out.push_back(static_cast<std::uint8_t>(word & 0xff));
    out.push_back(static_cast<std::uint8_t>(word >> 8));
  }
  out.insert(out.end(), data.begin(), data.end());
  std::uint32_t a = 1;
  std::uint32_t b = 0;
  for (const std::uint8_t byte : data) {
    a = (a + byte) % 65521;
    b = (b + a) % 65521;
  }
  append_big_endian(&out, b << 16 | a);
  return out;
}

}  // namespace

void append_chunk(std::vector<std::uint8_t>* png, std::string_view type, const std::vector<std::uint8_t>& data) {
  append_big_endian(png, static_cast<std::uint32_t>(data.size()));
  std::vector<std::uint8_t> checked(type.begin(), type.end());
  checked.insert(checked.end(), data.begin(), data.end());
  png->insert(png->end(), checked.begin(), checked.end());
  append_big_endian(png, bitwise_crc(checked));
}

std::vector<std::uint8_t> build_png(const PngParts& parts) {
  std::vector<std::uint8_t> png = {0x89, 'P', 'N', 'G', 0x0d, 0x0a, 0x1a, 0x0a};
  std::vector<std::uint8_t> header;
  append_big_endian(&header, parts.width);
  append_big_endian(&header, parts.height);
  header.insert(header.end(), {parts.bit_depth, parts.color_type, 0, 0, parts.interlace});
  append_chunk(&png, "IHDR", header);
  if (!parts.palette.empty()) append_chunk(&png, "PLTE", parts.palette);
  append_chunk(&png, "IDAT", stored(parts.scanlines));
  append_chunk(&png, "IEND", {});
  return png;
}

}  // namespace prescene::tests
