// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/bytes/crc32.h"

#include <zlib.h>

namespace prescene::interfaces {

std::uint32_t crc32(std::span<const std::uint8_t> bytes, std::uint32_t start) {
  if (bytes.empty()) return start;  // zlib takes a null pointer for a wish to begin anew.
  return static_cast<std::uint32_t>(::crc32_z(start, bytes.data(), bytes.size()));
}

}  // namespace prescene::interfaces
