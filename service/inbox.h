// SPDX-License-Identifier: Apache-2.0
// Between the bus's thread and the one that steps the belief: bounded per topic, the oldest goes first when it is full.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "prescene/interfaces/dds/dds_node.h"

namespace prescene::service {

/// Thread-safe.
class Inbox {
 public:
  /// How many messages of a topic may wait (>= 1); other topics' default is 100.
  explicit Inbox(std::map<std::string, std::size_t> limits) : limits_(std::move(limits)) {}

  void put(interfaces::ReceivedMessage&& message);
  /// Everything that waits, in order of arrival; waits for something until `until` at most, or until wake().
  std::vector<interfaces::ReceivedMessage> take_all(std::chrono::steady_clock::time_point until);
  void wake();
  /// Messages that were dropped because their topic was full.
  std::uint64_t dropped() const;

 private:
  std::map<std::string, std::size_t> limits_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<interfaces::ReceivedMessage> messages_;
  std::map<std::string, std::size_t> waiting_;
  bool woken_ = false;
  std::uint64_t dropped_ = 0;
};

}  // namespace prescene::service
