// SPDX-License-Identifier: Apache-2.0
#include "mcap_compression.h"

#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>
#include <memory>
#include <new>
#include <vector>

#include "prescene/core/check.h"
#include "zstd_compressor.h"

namespace prescene::interfaces {
namespace {

constexpr std::size_t kMinCompressedBytes = 1024;
constexpr std::size_t kInputStep = std::size_t{256} << 10;

/// The stored bytes, a piece at a time.
class Input {
 public:
  Input(const StoredBytes& stored, std::uint64_t size) : stored_(stored), left_(size) {}

  /// What was not consumed yet; the next piece when all was. Empty at the end.
  core::Result<std::span<const std::uint8_t>> rest() {
    if (consumed_ == piece_.size() && left_ > 0) {
      piece_.resize(static_cast<std::size_t>(std::min<std::uint64_t>(left_, kInputStep)));
      left_ -= piece_.size();
      consumed_ = 0;
      PRESCENE_RETURN_IF_ERROR(stored_(piece_));
    }
    return std::span<const std::uint8_t>(piece_).subspan(consumed_);
  }
  void consume(std::size_t count) { consumed_ += count; }
  bool at_end() const { return left_ == 0 && consumed_ == piece_.size(); }

 private:
  const StoredBytes& stored_;
  std::uint64_t left_;
  std::vector<std::uint8_t> piece_;
  std::size_t consumed_ = 0;
};

/// Where the output goes. Left uninitialised: pages that nothing is written to take no memory.
Decompressed empty_output(std::size_t claimed) {
  return {std::make_unique_for_overwrite<std::uint8_t[]>(claimed), 0, false};
}

core::Result<Decompressed> decompress_zstd(Input* input, std::size_t claimed) {
  const std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> context(ZSTD_createDCtx(), &ZSTD_freeDCtx);
  PRESCENE_CHECK(context != nullptr);
  Decompressed result = empty_output(claimed);
  ZSTD_outBuffer out{result.data.get(), claimed, 0};
  std::size_t expected = 1;  // 0 when a frame is finished.
  // When all bytes are out, the frame's end (its checksum) may be still to be read.
  while (out.pos < claimed || expected != 0) {
    PRESCENE_TRY(const std::span<const std::uint8_t> piece, input->rest());
    ZSTD_inBuffer in{piece.data(), piece.size(), 0};
    const std::size_t before = out.pos;
    expected = ZSTD_decompressStream(context.get(), &out, &in);
    input->consume(in.pos);
    if (ZSTD_isError(expected) != 0 || (in.pos == 0 && out.pos == before)) break;
  }
  result.size = out.pos;
  result.complete = result.size == claimed && (claimed == 0 || expected == 0) && input->at_end();
  return result;
}

core::Result<Decompressed> decompress_lz4(Input* input, std::size_t claimed) {
  LZ4F_dctx* raw_context = nullptr;
  PRESCENE_CHECK(LZ4F_isError(LZ4F_createDecompressionContext(&raw_context, LZ4F_VERSION)) == 0U);
  const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> context(raw_context,
                                                                                     &LZ4F_freeDecompressionContext);
  Decompressed result = empty_output(claimed);
  std::size_t hint = 1;  // 0 when the frame is finished.
  while (hint != 0) {
    PRESCENE_TRY(const std::span<const std::uint8_t> piece, input->rest());
    std::size_t out_bytes = claimed - result.size;
    std::size_t in_bytes = piece.size();
    hint =
        LZ4F_decompress(context.get(), result.data.get() + result.size, &out_bytes, piece.data(), &in_bytes, nullptr);
    if (LZ4F_isError(hint) != 0U) break;
    result.size += out_bytes;
    input->consume(in_bytes);
    if (out_bytes == 0 && in_bytes == 0) break;
  }
  result.complete = result.size == claimed && hint == 0 && input->at_end();
  return result;
}

core::Result<Decompressed> copied(const StoredBytes& stored, std::uint64_t stored_size, std::size_t claimed) {
  Decompressed result = empty_output(claimed);
  result.size = static_cast<std::size_t>(std::min<std::uint64_t>(claimed, stored_size));
  result.complete = result.size == claimed && result.size == stored_size;
  PRESCENE_RETURN_IF_ERROR(stored({result.data.get(), result.size}));
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

struct Compressor::Impl {
  McapCompression compression = McapCompression::kNone;
  std::optional<ZstdCompressor> zstd;
  std::vector<std::uint8_t> out;  // of LZ4

  std::span<const std::uint8_t> compress_lz4(std::span<const std::uint8_t> bytes);
};

std::span<const std::uint8_t> Compressor::Impl::compress_lz4(std::span<const std::uint8_t> bytes) {
  const std::size_t bound = LZ4F_compressFrameBound(bytes.size(), nullptr);
  if (out.size() < bound) out.resize(bound);
  const std::size_t size = LZ4F_compressFrame(out.data(), out.size(), bytes.data(), bytes.size(), nullptr);
  // The output is as large as it can get, so that only memory can be missing.
  if (LZ4F_isError(size) != 0U) throw std::bad_alloc();
  return std::span<const std::uint8_t>(out).first(size);
}

Compressor::Compressor(McapCompression compression) : impl_(std::make_unique<Impl>()) {
  impl_->compression = compression;
  if (compression == McapCompression::kZstd) impl_->zstd.emplace();
}
Compressor::Compressor(Compressor&&) noexcept = default;
Compressor& Compressor::operator=(Compressor&&) noexcept = default;
Compressor::~Compressor() = default;

std::optional<std::span<const std::uint8_t>> Compressor::compress(std::span<const std::uint8_t> bytes) {
  if (impl_->compression == McapCompression::kNone || bytes.size() < kMinCompressedBytes) return std::nullopt;
  const auto compressed = impl_->zstd ? impl_->zstd->compress(bytes) : impl_->compress_lz4(bytes);
  if (!compressed || compressed->size() > bytes.size() / 50 * 49) return std::nullopt;
  return compressed;
}

core::Result<Decompressed> decompress(McapCompression compression, const StoredBytes& stored, std::uint64_t stored_size,
                                      std::size_t claimed) {
  Input input(stored, stored_size);
  switch (compression) {
    case McapCompression::kZstd:
      return decompress_zstd(&input, claimed);
    case McapCompression::kLz4:
      return decompress_lz4(&input, claimed);
    case McapCompression::kNone:
      break;
  }
  return copied(stored, stored_size, claimed);
}

}  // namespace prescene::interfaces
