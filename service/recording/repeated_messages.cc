// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/recording/repeated_messages.h"

#include <algorithm>
#include <vector>

#include "prescene/service/tracking/topics.h"

namespace prescene::service {
namespace {

constexpr core::TimeNs kMovingNs = 10'000'000'000;  // the history of TfBufferSettings
// A frame waits for less: so the image of a camera that has stopped does not keep all of another one's.
constexpr core::TimeNs kImagesNs = 2'000'000'000;
constexpr std::size_t kMostStatic = 1000;  // messages of each topic
constexpr std::size_t kMostBytes = std::size_t{128} << 20;

}  // namespace

void RepeatedMessages::drop_front(std::deque<Entry>& from) {
  bytes_ -= from.front().first.cdr.size();
  from.pop_front();
}

void RepeatedMessages::keep(std::deque<Entry>& in, const interfaces::ReceivedMessage& message, MessageIndex index) {
  in.emplace_back(message, index);
  bytes_ += message.cdr.size();
}

void RepeatedMessages::note(const interfaces::ReceivedMessage& message, MessageIndex index) {
  const auto drop_older = [&](std::deque<Entry>& from, core::TimeNs by_ns) {
    while (!from.empty() && from.front().first.received_ns < message.received_ns - by_ns) drop_front(from);
  };
  if (is_image_type(message.type)) {
    if (!needs_images_) return;
    drop_older(images_, kImagesNs);
    keep(images_, message, index);
  } else if (message.type == "tf2_msgs/msg/TFMessage" && message.topic.ends_with("static")) {
    std::deque<Entry>& all = newest_[message.topic];
    const auto same = std::find_if(all.begin(), all.end(), [&](const Entry& e) { return e.first.cdr == message.cdr; });
    if (same != all.end()) return;
    keep(all, message, index);
    if (all.size() > kMostStatic) drop_front(all);
  } else if (message.type == "tf2_msgs/msg/TFMessage" || message.type == "sensor_msgs/msg/JointState") {
    drop_older(moving_, kMovingNs);
    keep(moving_, message, index);
  } else if (message.type == "sensor_msgs/msg/CameraInfo" || message.topic == kSettingsTopic) {
    std::deque<Entry>& one = newest_[message.topic];
    if (!one.empty()) drop_front(one);
    keep(one, message, index);
  } else if (message.type == "rosgraph_msgs/msg/Clock") {
    keep(clock_, message, index);
    if (!needs_images_ && clock_.size() > 1) drop_front(clock_);
  }
  for (std::deque<Entry>* from : {&images_, &clock_, &moving_})
    while (bytes_ > kMostBytes && from->size() > 1) drop_front(*from);
}

void RepeatedMessages::need_images_from(MessageIndex index) {
  needs_images_ = true;
  while (!images_.empty() && images_.front().second < index) drop_front(images_);
  while (clock_.size() > 1 && clock_[1].second <= index) drop_front(clock_);
}

core::Status RepeatedMessages::each(
    const std::function<core::Status(const interfaces::ReceivedMessage&, MessageIndex)>& take) const {
  std::vector<const Entry*> all;
  for (const auto& [topic, entries] : newest_)
    for (const Entry& entry : entries) all.push_back(&entry);
  for (const std::deque<Entry>* entries : {&moving_, &images_, &clock_})
    for (const Entry& entry : *entries) all.push_back(&entry);
  std::sort(all.begin(), all.end(), [](const Entry* a, const Entry* b) { return a->second < b->second; });
  for (const Entry* entry : all) PRESCENE_RETURN_IF_ERROR(take(entry->first, entry->second));
  return core::ok_status();
}

}  // namespace prescene::service
