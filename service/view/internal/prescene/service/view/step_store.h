// SPDX-License-Identifier: Apache-2.0
// What was shown of each step of a run, to be shown again in any order: in a temporary file that is gone with the
// program, whatever its end. Memory: some bytes a step.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "prescene/core/status.h"

namespace prescene::service {

/// Thread-safe.
class StepStore {
 public:
  /// In the system's folder for temporary files (TMPDIR); kUnavailable where it can't be written.
  static core::Result<std::unique_ptr<StepStore>> create(std::uint64_t most_bytes = std::uint64_t{8} << 30);
  ~StepStore();
  StepStore(const StepStore&) = delete;
  StepStore& operator=(const StepStore&) = delete;

  struct Entry {
    std::string text, picture;
  };
  /// Appends; the first has index 0. Beyond most_bytes pictures are left out, and counted. kUnavailable where nothing
  /// can be written any more.
  core::Status add(std::string_view text, std::string_view picture);
  std::uint64_t size() const;
  std::uint64_t pictures_left_out() const;
  /// kNotFound beyond the end, kUnavailable where the file can't be read.
  core::Result<Entry> read(std::uint64_t index) const;

 private:
  StepStore(int descriptor, std::uint64_t most_bytes) : descriptor_(descriptor), most_bytes_(most_bytes) {}
  struct Place {
    std::uint64_t offset;
    std::uint32_t text_bytes, picture_bytes;
  };
  int descriptor_;
  std::uint64_t most_bytes_;
  mutable std::mutex mutex_;  // guards all below
  std::vector<Place> places_;
  std::uint64_t end_ = 0, left_out_ = 0;
};

}  // namespace prescene::service
