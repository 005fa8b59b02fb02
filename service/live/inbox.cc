// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/live/inbox.h"

#include <iterator>
#include <utility>

namespace prescene::service {

void Inbox::put(interfaces::ReceivedMessage&& message) {
  {
    const std::lock_guard lock(mutex_);
    const std::string topic = message.topic;
    const auto limit_of = limits_.find(topic);
    const InboxLimit limit = limit_of == limits_.end() ? InboxLimit{} : limit_of->second;
    auto& waiting = by_topic_[topic];
    std::size_t& bytes = bytes_[topic];
    while (!waiting.empty() && (waiting.size() >= limit.messages || bytes + message.cdr.size() > limit.bytes)) {
      bytes -= waiting.front()->cdr.size();
      messages_.erase(waiting.front());
      waiting.pop_front();
      ++dropped_[topic];
    }
    // In an order that leaves all as it was where the memory ends.
    std::list<interfaces::ReceivedMessage> added;
    added.push_back(std::move(message));
    waiting.push_back(added.begin());
    bytes += added.front().cdr.size();
    messages_.splice(messages_.end(), added);
  }
  changed_.notify_one();
}

std::vector<interfaces::ReceivedMessage> Inbox::take_all(std::chrono::steady_clock::time_point until) {
  std::unique_lock lock(mutex_);
  changed_.wait_until(lock, until, [&] { return !messages_.empty() || woken_; });
  woken_ = false;
  by_topic_.clear();
  bytes_.clear();
  std::vector<interfaces::ReceivedMessage> taken(std::make_move_iterator(messages_.begin()),
                                                 std::make_move_iterator(messages_.end()));
  messages_.clear();
  return taken;
}

void Inbox::wake() {
  {
    const std::lock_guard lock(mutex_);
    woken_ = true;
  }
  changed_.notify_one();
}

std::map<std::string, std::uint64_t> Inbox::dropped_by_topic() const {
  const std::lock_guard lock(mutex_);
  return dropped_;
}

std::uint64_t Inbox::dropped() const {
  std::uint64_t sum = 0;
  for (const auto& [topic, count] : dropped_by_topic()) sum += count;
  return sum;
}

}  // namespace prescene::service
