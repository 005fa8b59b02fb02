// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/recording/read_ahead.h"

#include <utility>

namespace prescene::service {
namespace {

// What is read ahead: some frames' images, and what comes with them.
constexpr std::size_t kMostWaiting = 64;
constexpr std::size_t kMostWaitingBytes = std::size_t{16} << 20;

}  // namespace

ReadAhead::ReadAhead(RecordingReader& reader, Decode decode)
    : reader_(reader), decode_(std::move(decode)), ring_(kMostWaiting), thread_([this] { work(); }) {}

bool ReadAhead::is_full() const { return waiting_ == ring_.size() || waiting_bytes_ >= kMostWaitingBytes; }

/// Leaves `entry` empty at the end.
core::Status ReadAhead::prepare(std::optional<PreparedEntry>& entry) {
  PRESCENE_TRY(std::optional<RecordedEntry> recorded, reader_.next());
  if (!recorded) return core::ok_status();
  PreparedEntry prepared{*std::move(recorded), {}};
  if (!prepared.recorded.is_json) prepared.images = decode_(prepared.recorded.message);
  if (prepared.images.any()) prepared.recorded.message.cdr = {};
  entry = std::move(prepared);
  return core::ok_status();
}

ReadAhead::Read ReadAhead::read() {
  Read next;
  try {
    next.status = prepare(next.entry);
  } catch (...) {
    next.failure = std::current_exception();
  }
  return next;
}

void ReadAhead::work() {
  for (bool goes_on = true; goes_on;) {
    Read next = read();
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return stops_ || !is_full(); });
    if (stops_) return;
    goes_on = !next.is_last();
    ++waiting_;
    waiting_bytes_ += next.bytes();
    last_waiting() = std::move(next);
    changed_.notify_all();
  }
}

core::Result<std::optional<PreparedEntry>> ReadAhead::next() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return waiting_ > 0; });
  Read& first = ring_[first_];
  if (first.failure) std::rethrow_exception(first.failure);
  if (!first.status.ok()) return first.status;
  if (first.is_last()) return std::optional<PreparedEntry>();  // it stays, as an error does
  waiting_bytes_ -= first.bytes();
  std::optional<PreparedEntry> taken = std::exchange(first.entry, std::nullopt);
  first_ = (first_ + 1) % ring_.size();
  --waiting_;
  changed_.notify_all();
  return taken;
}

void ReadAhead::stop() {
  if (!thread_.joinable()) return;
  {
    const std::lock_guard lock(mutex_);
    stops_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

}  // namespace prescene::service
