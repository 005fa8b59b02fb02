// SPDX-License-Identifier: Apache-2.0
// Keeps what is written to a file safe from a power failure, without the writer waiting for the disk: a thread of its
// own asks the disk again and again to keep what there is (fdatasync).
//
//   PRESCENE_TRY(const auto sync, BackgroundSync::start(path, std::chrono::milliseconds(300)));
//   PRESCENE_RETURN_IF_ERROR(file.write(bytes));
//   sync->note_written();
//   if (sync->seconds_at_risk() > 1.0) ...                 // the disk does not keep up
#pragma once

#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include "prescene/core/status.h"

namespace prescene::interfaces {

/// What is written to the file is on the disk no later than `interval` and the time that the disk takes for two
/// requests after it was written. Thread-safe.
class BackgroundSync {
 public:
  /// Of a file that is there; whoever writes to it may close it before this ends. Its name in its folder is kept, too.
  /// kUnavailable where it can't be opened: there is no descriptor left.
  static core::Result<std::unique_ptr<BackgroundSync>> start(const std::filesystem::path& path,
                                                             std::chrono::milliseconds interval);
  /// Waits for a request that the disk is at; what was written since is left to the system.
  ~BackgroundSync();
  BackgroundSync(const BackgroundSync&) = delete;
  BackgroundSync& operator=(const BackgroundSync&) = delete;

  /// Something was written. Never waits for the disk.
  void note_written();
  /// The first error of the disk; stays.
  core::Status status() const;
  /// How long ago the oldest of what is not known to be on the disk was written, s; 0 = all of it is.
  double seconds_at_risk() const;

 private:
  using Clock = std::chrono::steady_clock;
  BackgroundSync(std::filesystem::path path, int descriptor, int folder, std::chrono::milliseconds interval);
  void run();

  std::filesystem::path path_;
  int descriptor_;
  int folder_;  // of the thread; -1: its name is kept
  std::chrono::milliseconds interval_;
  mutable std::mutex mutex_;  // guards all below
  std::condition_variable changed_;
  core::Status status_;
  std::optional<Clock::time_point> waiting_since_;  // written, and not asked for yet
  std::optional<Clock::time_point> asked_since_;    // the same, of what the disk is at
  bool ended_ = false;
  std::thread thread_;  // last: it uses all above
};

}  // namespace prescene::interfaces
