// SPDX-License-Identifier: Apache-2.0
// Where the bytes of a recording come from: a file, or memory.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "prescene/core/status.h"
#include "prescene/interfaces/bytes/file.h"

namespace prescene::interfaces {

class McapSource {
 public:
  explicit McapSource(InputFile file) : bytes_(std::move(file)) {}
  explicit McapSource(std::vector<std::uint8_t> bytes) : bytes_(std::move(bytes)) {}

  /// The path, or "recording".
  std::string name() const;
  std::uint64_t size() const;
  /// Fills `out` from `offset`; what lies beyond the end is kDataLoss.
  core::Status read(std::uint64_t offset, std::span<std::uint8_t> out) const;
  /// A short piece (at most 64 KiB, checked) through a window, for walking over many small records.
  core::Result<std::span<const std::uint8_t>> peek(std::uint64_t offset, std::size_t count);

 private:
  std::variant<InputFile, std::vector<std::uint8_t>> bytes_;
  std::vector<std::uint8_t> window_;
  std::uint64_t window_offset_ = 0;
};

}  // namespace prescene::interfaces
