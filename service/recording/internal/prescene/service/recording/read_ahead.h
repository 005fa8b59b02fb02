// SPDX-License-Identifier: Apache-2.0
// Reads a recording on a thread of its own, and decodes its images there, so that the belief waits for neither.
//
//   ReadAhead ahead(*reader, [&](const auto& message) { return tracker.decode(message); });
//   PRESCENE_TRY(auto entry, ahead.next());
//   if (entry) ... entry->recorded.message, entry->images
#pragma once

#include <condition_variable>
#include <cstddef>
#include <exception>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "prescene/service/recording/recording.h"
#include "prescene/service/tracking/image_messages.h"

namespace prescene::service {

struct PreparedEntry {
  RecordedEntry recorded;  ///< Without the bytes of messages whose images were decoded.
  DecodedImages images;
};

/// Not thread-safe. The reader is the thread's until stop().
class ReadAhead {
 public:
  /// `decode` is called by the thread, with the robot's messages.
  using Decode = std::function<DecodedImages(const interfaces::ReceivedMessage&)>;
  ReadAhead(RecordingReader& reader, Decode decode);
  ~ReadAhead() { stop(); }
  ReadAhead(const ReadAhead&) = delete;
  ReadAhead& operator=(const ReadAhead&) = delete;

  /// As RecordingReader::next(), with its exceptions. Not after stop().
  core::Result<std::optional<PreparedEntry>> next();
  /// The reader may be used again; what it had read already is gone.
  void stop();

 private:
  /// An entry; or the end, an error or an exception, after which nothing follows.
  struct Read {
    std::optional<PreparedEntry> entry;
    core::Status status;
    std::exception_ptr failure;

    bool is_last() const { return !entry; }
    std::size_t bytes() const { return entry ? entry->recorded.message.cdr.size() + entry->images.bytes() : 0; }
  };
  void work();
  core::Status prepare(std::optional<PreparedEntry>& entry);
  Read read();
  bool is_full() const;
  Read& last_waiting() { return ring_[(first_ + waiting_ - 1) % ring_.size()]; }

  RecordingReader& reader_;
  Decode decode_;
  std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  std::vector<Read> ring_;  // all of its memory from the start: the thread has nobody to tell that there is none
  std::size_t first_ = 0;
  std::size_t waiting_ = 0;
  std::size_t waiting_bytes_ = 0;
  bool stops_ = false;
  std::thread thread_;  // last, so that it ends before what it uses
};

}  // namespace prescene::service
