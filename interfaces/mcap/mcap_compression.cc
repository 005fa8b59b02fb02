// SPDX-License-Identifier: Apache-2.0
#include "mcap_compression.h"

#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>
#include <memory>

#include "prescene/core/check.h"

namespace prescene::interfaces {
namespace {

// Recording must keep up with cameras: zstd's fastest level writes some 300 MB/s a core and gains most of what more
// would.
constexpr int kZstdLevel = 1;
constexpr std::size_t kMinCompressedBytes = 1024;
constexpr std::size_t kOutputStep = std::size_t{1} << 20;

/// Room for the next step of output; false when all of `size` is there.
bool grow(std::vector<std::uint8_t>* out, std::size_t used, std::uint64_t size) {
  if (used == size) return false;
  if (used == out->size())
    out->resize(static_cast<std::size_t>(std::min<std::uint64_t>(size, used + std::max(used, kOutputStep))));
  return true;
}

Decompressed decompress_zstd(std::span<const std::uint8_t> bytes, std::uint64_t size) {
  const std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> context(ZSTD_createDCtx(), &ZSTD_freeDCtx);
  PRESCENE_CHECK(context != nullptr);
  Decompressed result;
  ZSTD_inBuffer in{bytes.data(), bytes.size(), 0};
  std::size_t used = 0;
  std::size_t expected = 1;  // 0 when a frame is finished.
  while (grow(&result.bytes, used, size)) {
    ZSTD_outBuffer out{result.bytes.data(), result.bytes.size(), used};
    const std::size_t before = in.pos;
    expected = ZSTD_decompressStream(context.get(), &out, &in);
    const bool stuck = in.pos == before && out.pos == used;
    used = out.pos;
    if (ZSTD_isError(expected) != 0 || stuck) break;
  }
  result.bytes.resize(used);
  if (used == size && ZSTD_isError(expected) == 0 && expected != 0) {
    // All bytes are out, the frame's end (its checksum) may be still to be read.
    std::uint8_t nothing = 0;
    ZSTD_outBuffer out{&nothing, 0, 0};
    expected = ZSTD_decompressStream(context.get(), &out, &in);
  }
  result.complete = used == size && (size == 0 || expected == 0) && in.pos == in.size;
  return result;
}

Decompressed decompress_lz4(std::span<const std::uint8_t> bytes, std::uint64_t size) {
  LZ4F_dctx* raw_context = nullptr;
  PRESCENE_CHECK(LZ4F_isError(LZ4F_createDecompressionContext(&raw_context, LZ4F_VERSION)) == 0U);
  const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> context(raw_context,
                                                                                     &LZ4F_freeDecompressionContext);
  Decompressed result;
  std::size_t used = 0;
  std::size_t consumed = 0;
  std::size_t hint = 1;  // 0 when the frame is finished.
  for (;;) {
    const bool room = grow(&result.bytes, used, size);
    std::size_t out_bytes = room ? result.bytes.size() - used : 0;
    std::size_t in_bytes = bytes.size() - consumed;
    std::uint8_t nothing = 0;
    hint = LZ4F_decompress(context.get(), room ? result.bytes.data() + used : &nothing, &out_bytes,
                           bytes.data() + consumed, &in_bytes, nullptr);
    if (LZ4F_isError(hint) != 0U) break;
    used += out_bytes;
    consumed += in_bytes;
    if (hint == 0 || (out_bytes == 0 && in_bytes == 0)) break;
  }
  result.bytes.resize(used);
  result.complete = used == size && hint == 0 && consumed == bytes.size();
  return result;
}

}  // namespace

std::string_view compression_name(McapCompression compression) {
  switch (compression) {
    case McapCompression::kLz4:
      return "lz4";
    case McapCompression::kZstd:
      return "zstd";
    case McapCompression::kNone:
      break;
  }
  return "";
}

std::optional<McapCompression> find_compression(std::string_view name) {
  for (const McapCompression known : {McapCompression::kNone, McapCompression::kLz4, McapCompression::kZstd}) {
    if (compression_name(known) == name) return known;
  }
  return std::nullopt;
}

std::optional<std::vector<std::uint8_t>> compress(McapCompression compression, std::span<const std::uint8_t> bytes) {
  if (compression == McapCompression::kNone || bytes.size() < kMinCompressedBytes) return std::nullopt;
  std::vector<std::uint8_t> out;
  if (compression == McapCompression::kZstd) {
    out.resize(ZSTD_compressBound(bytes.size()));
    const std::size_t size = ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), kZstdLevel);
    PRESCENE_CHECK(ZSTD_isError(size) == 0U);
    out.resize(size);
  } else {
    out.resize(LZ4F_compressFrameBound(bytes.size(), nullptr));
    const std::size_t size = LZ4F_compressFrame(out.data(), out.size(), bytes.data(), bytes.size(), nullptr);
    PRESCENE_CHECK(LZ4F_isError(size) == 0U);
    out.resize(size);
  }
  if (out.size() > bytes.size() / 50 * 49) return std::nullopt;
  return out;
}

Decompressed decompress(McapCompression compression, std::span<const std::uint8_t> bytes, std::uint64_t size) {
  switch (compression) {
    case McapCompression::kZstd:
      return decompress_zstd(bytes, size);
    case McapCompression::kLz4:
      return decompress_lz4(bytes, size);
    case McapCompression::kNone:
      break;
  }
  const std::size_t kept = static_cast<std::size_t>(std::min<std::uint64_t>(size, bytes.size()));
  return {{bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(kept)}, size == bytes.size()};
}

}  // namespace prescene::interfaces
