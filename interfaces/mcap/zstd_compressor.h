// SPDX-License-Identifier: Apache-2.0
// Compresses a chunk of a recording in one frame of zstd [Collet & Kucherawy 2021], and what does not shrink not at
// all: the noise of a colour image, or a JPEG, would take as long as everything else and save nothing. Such stretches
// are the frame's raw blocks, so that every reader of zstd reads it.
#pragma once

#include <zstd.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace prescene::interfaces {

/// Not thread-safe. std::bad_alloc where there is no memory.
class ZstdCompressor {
 public:
  ZstdCompressor();

  /// A frame, valid until the next call; empty where nothing of the bytes shrinks.
  std::optional<std::span<const std::uint8_t>> compress(std::span<const std::uint8_t> bytes);

 private:
  /// A stretch of whole blocks.
  struct Stretch {
    std::size_t begin = 0;
    std::size_t end = 0;
  };
  /// From the first to the last block that shrinks; the others between them are few in images.
  Stretch shrinking(std::span<const std::uint8_t> bytes);
  bool shrinks(std::span<const std::uint8_t> block);
  void begin_frame(std::uint64_t content_size);
  void add_raw(std::span<const std::uint8_t> bytes);
  void add_compressed(std::span<const std::uint8_t> bytes);
  /// A frame of its own at out_[size_]; how long it is.
  std::size_t frame_of(std::span<const std::uint8_t> bytes);
  std::span<const std::uint8_t> end_frame();

  std::unique_ptr<ZSTD_CCtx, decltype(&ZSTD_freeCCtx)> context_;
  std::vector<std::uint8_t> out_;
  std::size_t size_ = 0;        // of out_ that is written
  std::size_t last_block_ = 0;  // where the newest block's header is
};

}  // namespace prescene::interfaces
