// SPDX-License-Identifier: Apache-2.0
// What waits to be sent to one client.
#pragma once

#include <cstddef>
#include <deque>
#include <memory>
#include <string>

#include "prescene/interfaces/web/web_server.h"

namespace prescene::interfaces {

/// Not thread-safe.
class ClientQueue {
 public:
  ClientQueue(std::size_t max_newest, std::size_t max_bytes) : max_newest_(max_newest), max_bytes_(max_bytes) {}

  /// Returns how many messages of kNewest were left out for it, the message itself perhaps.
  std::size_t add(WebMessagePtr message);
  /// Whether more of kEach waits than may.
  bool is_overfull() const { return bytes_ > max_bytes_; }

  bool empty() const { return messages_.empty(); }
  std::size_t size() const { return messages_.size(); }
  /// Of the first message, what is not sent yet. Not empty (checked).
  std::string_view front() const;
  void sent(std::size_t bytes);
  void clear();

 private:
  std::size_t drop_oldest_newest();

  std::size_t max_newest_, max_bytes_;
  std::deque<WebMessagePtr> messages_;
  std::size_t offset_ = 0;  // of the first, bytes that are sent
  std::size_t bytes_ = 0;
  std::size_t newest_ = 0;  // messages of kNewest among them
};

}  // namespace prescene::interfaces
