// SPDX-License-Identifier: Apache-2.0
// Between the bus's thread and the one that steps the belief: bounded per topic, in messages and in bytes. When a topic
// is full, its oldest messages are dropped and counted.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <list>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "prescene/interfaces/dds/dds_node.h"

namespace prescene::service {

/// How much of a topic may wait. A message that is larger than `bytes` waits alone.
struct InboxLimit {
  std::size_t messages = 100;  ///< >= 1.
  std::size_t bytes = std::size_t{16} << 20;
};

/// Thread-safe.
class Inbox {
 public:
  /// Topics that are not named have the default limit.
  explicit Inbox(std::map<std::string, InboxLimit> limits) : limits_(std::move(limits)) {}

  void put(interfaces::ReceivedMessage&& message);
  /// Everything that waits, in order of arrival; waits for something until `until` at most, or until wake().
  std::vector<interfaces::ReceivedMessage> take_all(std::chrono::steady_clock::time_point until);
  void wake();
  /// Messages that were dropped because their topic was full, by topic; topics that lost none are left out.
  std::map<std::string, std::uint64_t> dropped_by_topic() const;
  /// Their sum.
  std::uint64_t dropped() const;

 private:
  std::map<std::string, InboxLimit> limits_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::list<interfaces::ReceivedMessage> messages_;
  /// Where each topic's waiting messages are, oldest first: the oldest is found at once, however many others wait.
  std::map<std::string, std::deque<std::list<interfaces::ReceivedMessage>::iterator>> by_topic_;
  std::map<std::string, std::size_t> bytes_;
  bool woken_ = false;
  std::map<std::string, std::uint64_t> dropped_;
};

}  // namespace prescene::service
