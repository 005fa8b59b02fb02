// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/bytes/background_sync.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <exception>
#include <utility>

#include "disk.h"

namespace prescene::interfaces {

using core::Result;
using core::Status;

Result<std::unique_ptr<BackgroundSync>> BackgroundSync::start(const std::filesystem::path& path,
                                                              std::chrono::milliseconds interval) {
  const int descriptor = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
  if (descriptor < 0) return disk_error(path, errno);
  // Now: later there may be no descriptor left.
  const Result<int> folder = open_folder_of(path);
  if (!folder) ::close(descriptor);
  PRESCENE_RETURN_IF_ERROR(folder.status());
  return std::unique_ptr<BackgroundSync>(new BackgroundSync(path, descriptor, *folder, interval));
}

BackgroundSync::BackgroundSync(std::filesystem::path path, int descriptor, int folder,
                               std::chrono::milliseconds interval)
    : path_(std::move(path)), descriptor_(descriptor), folder_(folder), interval_(interval), thread_([this] {
        run();
      }) {}

BackgroundSync::~BackgroundSync() {
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
  }
  changed_.notify_all();
  thread_.join();
  ::close(descriptor_);
  if (folder_ >= 0) ::close(folder_);
}

void BackgroundSync::note_written() {
  const std::lock_guard lock(mutex_);
  if (waiting_since_) return;
  waiting_since_ = Clock::now();
  changed_.notify_all();
}

Status BackgroundSync::status() const {
  const std::lock_guard lock(mutex_);
  return status_;
}

double BackgroundSync::seconds_at_risk() const {
  const std::lock_guard lock(mutex_);
  const auto& oldest = asked_since_ ? asked_since_ : waiting_since_;
  return oldest ? std::chrono::duration<double>(Clock::now() - *oldest).count() : 0.0;
}

void BackgroundSync::run() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return ended_ || waiting_since_; });
    if (ended_) return;
    // What is written meanwhile goes with it.
    if (changed_.wait_until(lock, *waiting_since_ + interval_, [this] { return ended_; })) return;
    asked_since_ = std::exchange(waiting_since_, std::nullopt);
    lock.unlock();
    Status synced;
    try {
      synced = sync_content(descriptor_, path_);
      if (synced.ok()) synced = sync_and_close_folder(std::exchange(folder_, -1), path_);
    } catch (const std::exception&) {  // The disk failed, and there is no memory for the words.
      synced = Status(core::StatusCode::kUnavailable, "out of memory");
    }
    lock.lock();
    if (status_.ok()) status_ = std::move(synced);
    asked_since_.reset();
  }
}

}  // namespace prescene::interfaces
