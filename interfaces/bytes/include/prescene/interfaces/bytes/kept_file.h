// SPDX-License-Identifier: Apache-2.0
// A small file that is written anew from time to time and is whole whatever happens: after a power failure, too, it is
// one of those that were put. A thread of its own waits for the disk.
//
//   KeptFile kept(path);
//   kept.put("friction: 0.4\n");                 // returns at once
//   PRESCENE_RETURN_IF_ERROR(kept.wait());       // in the end
#pragma once

#include <condition_variable>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "prescene/core/status.h"

namespace prescene::interfaces {

/// Thread-safe.
class KeptFile {
 public:
  /// Touches nothing yet.
  explicit KeptFile(std::filesystem::path path);
  /// Waits for what was put.
  ~KeptFile();
  KeptFile(const KeptFile&) = delete;
  KeptFile& operator=(const KeptFile&) = delete;

  /// Replaces the file. Of several that wait for the disk, only the newest is written.
  void put(std::string text);
  /// Waits until nothing waits, then as status().
  core::Status wait();
  /// Whether something that was put is not written yet.
  bool is_busy() const;
  /// Of the last one that was written: errors of write_file, and of a disk that does not keep it.
  core::Status status() const;

 private:
  void run();

  std::filesystem::path path_;
  mutable std::mutex mutex_;  // guards all below
  std::condition_variable changed_;
  std::optional<std::string> waiting_;
  bool is_writing_ = false;
  bool ended_ = false;
  core::Status status_;
  std::thread thread_;  // last: it uses all above
};

}  // namespace prescene::interfaces
