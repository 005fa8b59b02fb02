// SPDX-License-Identifier: Apache-2.0
// The part of a recording's index that grows with it, while it is written: a recording of days would fill the memory.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <vector>

#include "mcap_records.h"
#include "prescene/core/status.h"
#include "prescene/interfaces/bytes/file.h"

namespace prescene::interfaces {

/// Keeps whole records, in memory up to 256 KiB and beyond in a file without a name in the recording's folder, which
/// the system frees with the program. Not thread-safe.
class ChunkIndexStore {
 public:
  explicit ChunkIndexStore(std::filesystem::path recording) : recording_(std::move(recording)) {}

  /// kUnavailable where the file can't be made or written; errors speak of the recording. Where memory ends, the
  /// exception is passed on and nothing was added.
  core::Status add(const mcap_records::ChunkIndex& index);
  std::uint64_t bytes() const { return in_file_ + newest_.size(); }
  /// Hands over all bytes in their order.
  core::Status read(const std::function<core::Status(std::span<const std::uint8_t>)>& take);

 private:
  core::Status open_file();

  std::filesystem::path recording_;
  std::vector<std::uint8_t> newest_;  // not in the file
  OutputFile out_;
  InputFile in_;  // the same file
  std::uint64_t in_file_ = 0;
};

}  // namespace prescene::interfaces
