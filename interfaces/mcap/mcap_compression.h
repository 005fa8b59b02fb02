// SPDX-License-Identifier: Apache-2.0
// The compressions of MCAP chunks: none, zstd, and lz4 in its frame format.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "prescene/interfaces/mcap/mcap.h"

namespace prescene::interfaces {

/// "", "lz4" or "zstd".
std::string_view compression_name(McapCompression compression);
std::optional<McapCompression> find_compression(std::string_view name);

/// The bytes compressed, or nothing when that would gain less than 2 %.
std::optional<std::vector<std::uint8_t>> compress(McapCompression compression, std::span<const std::uint8_t> bytes);

struct Decompressed {
  std::vector<std::uint8_t> bytes;  ///< As many as could be had.
  bool complete = false;            ///< All `size` bytes, and the input ended where it should.
};
/// At most `size` bytes; memory grows with what really comes out, not with `size`.
Decompressed decompress(McapCompression compression, std::span<const std::uint8_t> bytes, std::uint64_t size);

}  // namespace prescene::interfaces
