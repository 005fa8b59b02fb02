// SPDX-License-Identifier: Apache-2.0
#include "zstd_compressor.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <new>

#include "prescene/core/check.h"

namespace prescene::interfaces {
namespace {

// Recording must keep up with cameras beside everything else that a robot computes. Of real 640 x 480 colour and depth
// images, level 1 leaves 50 % at 250 to 270 MB/s, level -3 leaves 54 % at 460 MB/s, and LZ4 56 % at 580 MB/s, of depth
// alone 19, 24 and 27 % (six frames, one core, zstd 1.5.4).
constexpr int kZstdLevel = -3;

// The format's numbers.
constexpr std::size_t kBlock = std::size_t{128} << 10;  // no block holds more
constexpr std::size_t kBlockHeader = 3;
constexpr std::array<std::uint8_t, 4> kMagic = {0x28, 0xb5, 0x2f, 0xfd};
constexpr std::uint8_t kHasContentSize = 3 << 6;           // in eight bytes
constexpr std::uint8_t kBlockWindow = (17 - 10) << 3;      // of kBlock: a window is no smaller than a block
constexpr std::size_t kDescriptorAt = kMagic.size();       // what the header holds, ...
constexpr std::size_t kWindowAt = kDescriptorAt + 1;       // ... the window
constexpr std::size_t kHeaderWithoutSize = kWindowAt + 1;  // ... and then the content's size, or none
constexpr std::size_t kHeader = kHeaderWithoutSize + sizeof(std::uint64_t);
enum BlockType : std::uint32_t { kRaw = 0, kRepeated = 1 };

// So much of a block says whether the block shrinks: one that saves less than a tenth is not worth its time.
constexpr std::size_t kSample = std::size_t{4} << 10;
constexpr std::size_t kMostOfSample = kSample / 10 * 9;

void put_block_header(bool is_last, std::uint32_t type, std::size_t size, std::uint8_t* at) {
  const std::uint32_t header = static_cast<std::uint32_t>(size) << 3 | type << 1 | (is_last ? 1U : 0U);
  for (std::size_t i = 0; i < kBlockHeader; ++i) at[i] = static_cast<std::uint8_t>(header >> 8 * i);
}

/// Of a whole block, with its header.
std::size_t block_bytes(const std::uint8_t* at) {
  const std::uint32_t header = at[0] | static_cast<std::uint32_t>(at[1]) << 8 | static_cast<std::uint32_t>(at[2]) << 16;
  return kBlockHeader + ((header >> 1 & 3U) == kRepeated ? 1 : header >> 3);
}

std::size_t checked(std::size_t size) {
  // The output is as large as it can get, so that only memory can be missing.
  if (ZSTD_isError(size) != 0U) throw std::bad_alloc();
  return size;
}

}  // namespace

ZstdCompressor::ZstdCompressor() : context_(ZSTD_createCCtx(), &ZSTD_freeCCtx) {
  if (context_ == nullptr) throw std::bad_alloc();
  checked(ZSTD_CCtx_setParameter(context_.get(), ZSTD_c_compressionLevel, kZstdLevel));
  // The header of a part would say the size of the part.
  checked(ZSTD_CCtx_setParameter(context_.get(), ZSTD_c_contentSizeFlag, 0));
}

std::optional<std::span<const std::uint8_t>> ZstdCompressor::compress(std::span<const std::uint8_t> bytes) {
  const std::size_t bound = kHeader + 2 * kHeaderWithoutSize + ZSTD_compressBound(bytes.size()) +
                            kBlockHeader * (bytes.size() / kBlock + 2) + ZSTD_compressBound(kSample);
  if (out_.size() < bound) out_.resize(bound);
  size_ = 0;
  const Stretch part = shrinking(bytes);
  if (part.begin == part.end) return std::nullopt;
  begin_frame(bytes.size());
  add_raw(bytes.first(part.begin));
  add_compressed(bytes.subspan(part.begin, part.end - part.begin));
  add_raw(bytes.subspan(part.end));
  return end_frame();
}

ZstdCompressor::Stretch ZstdCompressor::shrinking(std::span<const std::uint8_t> bytes) {
  Stretch found;
  for (std::size_t at = 0; at < bytes.size(); at += kBlock) {
    const std::size_t end = std::min(bytes.size(), at + kBlock);
    if (!shrinks(bytes.subspan(at, end - at))) continue;
    if (found.begin == found.end) found.begin = at;
    found.end = end;
  }
  return found;
}

bool ZstdCompressor::shrinks(std::span<const std::uint8_t> block) {
  if (block.size() < 2 * kSample) return true;
  return frame_of(block.subspan(block.size() / 2, kSample)) <= kMostOfSample;
}

std::size_t ZstdCompressor::frame_of(std::span<const std::uint8_t> bytes) {
  return checked(ZSTD_compress2(context_.get(), out_.data() + size_, out_.size() - size_, bytes.data(), bytes.size()));
}

void ZstdCompressor::begin_frame(std::uint64_t content_size) {
  std::copy(kMagic.begin(), kMagic.end(), out_.begin());
  out_[kDescriptorAt] = kHasContentSize;
  out_[kWindowAt] = kBlockWindow;
  for (std::size_t i = 0; i < sizeof content_size; ++i)
    out_[kHeaderWithoutSize + i] = static_cast<std::uint8_t>(content_size >> 8 * i);
  size_ = kHeader;
}

void ZstdCompressor::add_raw(std::span<const std::uint8_t> bytes) {
  for (std::size_t at = 0; at < bytes.size(); at += kBlock) {
    const auto block = bytes.subspan(at, std::min(kBlock, bytes.size() - at));
    last_block_ = size_;
    put_block_header(false, kRaw, block.size(), out_.data() + size_);
    std::copy(block.begin(), block.end(), out_.begin() + static_cast<std::ptrdiff_t>(size_ + kBlockHeader));
    size_ += kBlockHeader + block.size();
  }
}

/// The blocks of a frame of their own. They refer to nothing before them, and what raw blocks are before them changes
/// nothing of what a decoder knows.
void ZstdCompressor::add_compressed(std::span<const std::uint8_t> bytes) {
  const std::size_t length = frame_of(bytes);
  std::uint8_t* const frame = out_.data() + size_;
  PRESCENE_CHECK(length > kHeaderWithoutSize && frame[kDescriptorAt] == 0);
  out_[kWindowAt] = std::max(out_[kWindowAt], frame[kWindowAt]);
  std::memmove(frame, frame + kHeaderWithoutSize, length - kHeaderWithoutSize);
  const std::size_t end = size_ + length - kHeaderWithoutSize;
  while (size_ < end) {
    last_block_ = size_;
    out_[size_] &= 0xfe;  // not the last of this frame
    size_ += block_bytes(out_.data() + size_);
  }
  PRESCENE_CHECK(size_ == end);
}

std::span<const std::uint8_t> ZstdCompressor::end_frame() {
  out_[last_block_] |= 1;
  return std::span<const std::uint8_t>(out_).first(size_);
}

}  // namespace prescene::interfaces
