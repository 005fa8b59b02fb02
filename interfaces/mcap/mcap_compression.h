// SPDX-License-Identifier: Apache-2.0
// The compressions of MCAP chunks: none, zstd, and lz4 in its frame format.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include "prescene/core/status.h"
#include "prescene/interfaces/mcap/mcap.h"

namespace prescene::interfaces {

/// "", "lz4" or "zstd".
std::string_view compression_name(McapCompression compression);
std::optional<McapCompression> find_compression(std::string_view name);

/// Compresses one chunk after the other. It keeps its memory, because fresh pages for each chunk cost a recorder of
/// images a third of what compressing does.
class Compressor {
 public:
  explicit Compressor(McapCompression compression);
  Compressor(Compressor&&) noexcept;
  Compressor& operator=(Compressor&&) noexcept;
  ~Compressor();
  /// The bytes compressed, or nothing when that would gain less than 2 %. The span is valid until the next call.
  std::optional<std::span<const std::uint8_t>> compress(std::span<const std::uint8_t> bytes);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

struct Decompressed {
  std::unique_ptr<std::uint8_t[]> data;
  std::size_t size = 0;   ///< As many bytes as could be had.
  bool complete = false;  ///< All that were claimed, and the input ended where it should.
  std::span<const std::uint8_t> bytes() const { return {data.get(), size}; }
};
/// Fills the span with the stored bytes that come next.
using StoredBytes = std::function<core::Status(std::span<std::uint8_t>)>;
/// At most `claimed` bytes out of `stored_size`, which are asked for piece by piece. `claimed` bytes of address space
/// are reserved (the caller bounds them); only what really comes out is touched, and up to 128 MiB for zstd's window.
/// Errors are those of `stored`.
core::Result<Decompressed> decompress(McapCompression compression, const StoredBytes& stored, std::uint64_t stored_size,
                                      std::size_t claimed);

}  // namespace prescene::interfaces
