// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/recording/repeated_messages.h"

#include <algorithm>
#include <set>
#include <vector>

#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/interfaces/ros_messages/conversions.h"
#include "prescene/service/tracking/topics.h"

namespace prescene::service {
namespace {

constexpr core::TimeNs kMovingNs = 10'000'000'000;  // the history of TfBufferSettings
// A frame waits for less: so the image of a camera that has stopped does not keep all of another one's.
constexpr core::TimeNs kImagesNs = 2'000'000'000;
constexpr std::size_t kMostStatic = 1000;  // messages

/// Between which frames its transforms are, the same for messages of which the later one replaces all that the earlier
/// one says; "" where any of it is refused.
std::string frames_of(const interfaces::ReceivedMessage& message) {
  const auto tf = interfaces::decode_cdr<interfaces::RosTfMessage>(message.cdr);
  if (!tf) return "";
  const auto transforms = interfaces::to_transforms(*tf);
  if (!transforms || !transforms->rejected.empty()) return "";
  std::set<std::string> pairs;
  for (const interfaces::FrameTransform& transform : transforms->accepted)
    pairs.insert(transform.parent + '\n' + transform.child + '\n');
  std::string frames;
  for (const std::string& pair : pairs) frames += pair;
  return frames;
}

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
  } else if (message.type == "tf2_msgs/msg/TFMessage" && message.topic == tf_static_) {
    note_static(message, index);
  } else if (message.type == "tf2_msgs/msg/TFMessage" || message.type == "sensor_msgs/msg/JointState") {
    drop_older(moving_, kMovingNs);
    keep(moving_, message, index);
  } else if (message.type == "sensor_msgs/msg/CameraInfo" || message.topic == kSettingsTopic) {
    std::deque<Entry>& one = newest_[message.topic];
    keep(one, message, index);
    if (one.size() > 1) drop_front(one);
  } else if (message.type == "rosgraph_msgs/msg/Clock") {
    keep(clock_, message, index);
    if (!needs_images_ && clock_.size() > 1) drop_front(clock_);
  }
  for (std::deque<Entry>* from : {&images_, &clock_, &moving_}) {
    for (; bytes_ > kMostBytes && from->size() > 1; ++dropped_) drop_front(*from);
  }
  for (; bytes_ > kMostBytes && static_.size() > 1; ++dropped_) drop_static(0);
}

void RepeatedMessages::drop_static(std::size_t number) {
  bytes_ -= static_[number].entry.first.cdr.size();
  static_.erase(static_.begin() + static_cast<std::ptrdiff_t>(number));
}

void RepeatedMessages::note_static(const interfaces::ReceivedMessage& message, MessageIndex index) {
  std::string frames = frames_of(message);
  std::vector<std::size_t> same;
  for (std::size_t i = 0; i < static_.size(); ++i) {
    const Static& other = static_[i];
    if (other.frames == frames && (!frames.empty() || other.entry.first.cdr == message.cdr)) same.push_back(i);
  }
  static_.push_back({{message, index}, std::move(frames)});
  bytes_ += message.cdr.size();
  // The first stays, too.
  if (same.size() > 1) drop_static(same.back());
  for (; static_.size() > kMostStatic; ++dropped_) drop_static(0);
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
  for (const Static& kept : static_) all.push_back(&kept.entry);
  for (const std::deque<Entry>* entries : {&moving_, &images_, &clock_})
    for (const Entry& entry : *entries) all.push_back(&entry);
  std::sort(all.begin(), all.end(), [](const Entry* a, const Entry* b) { return a->second < b->second; });
  for (const Entry* entry : all) PRESCENE_RETURN_IF_ERROR(take(entry->first, entry->second));
  return core::ok_status();
}

}  // namespace prescene::service
