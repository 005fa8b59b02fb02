// SPDX-License-Identifier: Apache-2.0
#include "client_queue.h"

#include <algorithm>

#include "prescene/core/check.h"

namespace prescene::interfaces {

std::size_t ClientQueue::add(WebMessagePtr message) {
  bytes_ += message->frame.size();
  newest_ += message->delivery == WebDelivery::kNewest ? 1 : 0;
  messages_.push_back(std::move(message));
  std::size_t left_out = 0;
  while (newest_ > max_newest_ || bytes_ > max_bytes_) {
    const std::size_t dropped = drop_oldest_newest();
    if (dropped == 0) break;
    left_out += dropped;
  }
  return left_out;
}

std::size_t ClientQueue::drop_oldest_newest() {
  // One of which a part is sent must be sent whole.
  const auto begin = messages_.begin() + (offset_ > 0 ? 1 : 0);
  const auto oldest = std::find_if(
      begin, messages_.end(), [](const WebMessagePtr& message) { return message->delivery == WebDelivery::kNewest; });
  if (oldest == messages_.end()) return 0;
  bytes_ -= (*oldest)->frame.size();
  --newest_;
  messages_.erase(oldest);
  return 1;
}

std::string_view ClientQueue::front() const {
  PRESCENE_CHECK(!messages_.empty());
  return std::string_view(messages_.front()->frame).substr(offset_);
}

void ClientQueue::sent(std::size_t bytes) {
  PRESCENE_CHECK(!messages_.empty());
  offset_ += bytes;
  const WebMessage& first = *messages_.front();
  if (offset_ < first.frame.size()) return;
  offset_ = 0;
  bytes_ -= first.frame.size();
  newest_ -= first.delivery == WebDelivery::kNewest ? 1 : 0;
  messages_.pop_front();
}

void ClientQueue::clear() {
  messages_.clear();
  offset_ = bytes_ = newest_ = 0;
}

}  // namespace prescene::interfaces
