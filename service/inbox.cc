// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/inbox.h"

#include <algorithm>
#include <utility>

namespace prescene::service {

void Inbox::put(interfaces::ReceivedMessage&& message) {
  {
    const std::lock_guard lock(mutex_);
    const auto limit = limits_.find(message.topic);
    std::size_t& waiting = waiting_[message.topic];
    if (waiting >= (limit == limits_.end() ? 100 : limit->second)) {
      const auto oldest =
          std::find_if(messages_.begin(), messages_.end(),
                       [&](const interfaces::ReceivedMessage& other) { return other.topic == message.topic; });
      messages_.erase(oldest);
      --waiting;
      ++dropped_;
    }
    ++waiting;
    messages_.push_back(std::move(message));
  }
  changed_.notify_one();
}

std::vector<interfaces::ReceivedMessage> Inbox::take_all(std::chrono::steady_clock::time_point until) {
  std::unique_lock lock(mutex_);
  changed_.wait_until(lock, until, [&] { return !messages_.empty() || woken_; });
  woken_ = false;
  waiting_.clear();
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

std::uint64_t Inbox::dropped() const {
  const std::lock_guard lock(mutex_);
  return dropped_;
}

}  // namespace prescene::service
