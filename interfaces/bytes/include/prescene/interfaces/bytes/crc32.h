// SPDX-License-Identifier: Apache-2.0
// The CRC-32 of zlib, PNG and MCAP (polynomial 0x04c11db7 reflected, inverted at both ends).
#pragma once

#include <cstdint>
#include <span>

namespace prescene::interfaces {

/// Of the bytes; `start` is the value of what came before them: crc32(b, crc32(a)) is that of a and b together.
std::uint32_t crc32(std::span<const std::uint8_t> bytes, std::uint32_t start = 0);

}  // namespace prescene::interfaces
