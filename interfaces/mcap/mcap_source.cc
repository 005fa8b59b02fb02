// SPDX-License-Identifier: Apache-2.0
#include "mcap_source.h"

#include <algorithm>
#include <cstring>

#include "prescene/core/check.h"

namespace prescene::interfaces {
namespace {

constexpr std::size_t kWindowBytes = std::size_t{64} << 10;

}  // namespace

std::string McapSource::name() const {
  const auto* file = std::get_if<InputFile>(&bytes_);
  return file != nullptr ? file->path().string() : "recording";
}

std::uint64_t McapSource::size() const {
  const auto* file = std::get_if<InputFile>(&bytes_);
  return file != nullptr ? file->size() : std::get<std::vector<std::uint8_t>>(bytes_).size();
}

core::Status McapSource::read(std::uint64_t offset, std::span<std::uint8_t> out) const {
  if (const auto* file = std::get_if<InputFile>(&bytes_)) return file->read(offset, out);
  const auto& memory = std::get<std::vector<std::uint8_t>>(bytes_);
  if (offset > memory.size() || out.size() > memory.size() - offset) return core::data_loss("recording: ends before");
  std::copy_n(memory.begin() + static_cast<std::ptrdiff_t>(offset), out.size(), out.begin());
  return core::ok_status();
}

core::Result<std::span<const std::uint8_t>> McapSource::peek(std::uint64_t offset, std::size_t count) {
  PRESCENE_CHECK(count <= kWindowBytes);
  const bool inside = offset >= window_offset_ && offset - window_offset_ <= window_.size() &&
                      count <= window_.size() - (offset - window_offset_);
  if (!inside) {
    const std::uint64_t available = size() - std::min(size(), offset);
    if (count > available) return core::data_loss(name() + ": ends at byte " + std::to_string(size()));
    window_.resize(static_cast<std::size_t>(std::min<std::uint64_t>(available, kWindowBytes)));
    window_offset_ = offset;
    PRESCENE_RETURN_IF_ERROR(read(offset, window_));
  }
  return std::span<const std::uint8_t>(window_).subspan(static_cast<std::size_t>(offset - window_offset_), count);
}

}  // namespace prescene::interfaces
