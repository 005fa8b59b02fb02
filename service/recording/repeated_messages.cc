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
constexpr std::size_t kMostBytes = std::size_t{128} << 20;

/// The same for messages of which the later one replaces all that the earlier one says: between which frames their
/// transforms are. Of what is refused, even in part, its bytes.
std::string frames_of(const interfaces::ReceivedMessage& message) {
  const auto tf = interfaces::decode_cdr<interfaces::RosTfMessage>(message.cdr);
  if (tf) {
    const auto transforms = interfaces::to_transforms(*tf);
    if (transforms && transforms->rejected.empty()) {
      std::set<std::string> pairs;
      for (const interfaces::FrameTransform& transform : transforms->accepted)
        pairs.insert(transform.parent + '\n' + transform.child + '\n');
      std::string frames = "frames ";
      for (const std::string& pair : pairs) frames += pair;
      return frames;
    }
  }
  return "bytes " + std::string(message.cdr.begin(), message.cdr.end());
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
    if (!one.empty()) drop_front(one);
    keep(one, message, index);
  } else if (message.type == "rosgraph_msgs/msg/Clock") {
    keep(clock_, message, index);
    if (!needs_images_ && clock_.size() > 1) drop_front(clock_);
  }
  for (std::deque<Entry>* from : {&images_, &clock_, &moving_})
    while (bytes_ > kMostBytes && from->size() > 1) drop_front(*from);
}

void RepeatedMessages::note_static(const interfaces::ReceivedMessage& message, MessageIndex index) {
  static_frames_.resize(static_.size());  // where there was no memory for the one before
  std::string frames = frames_of(message);
  const auto first = std::find(static_frames_.begin(), static_frames_.end(), frames);
  const auto newest = std::find(static_frames_.rbegin(), static_frames_.rend(), frames);
  if (first != static_frames_.end() && std::next(newest).base() != first) {
    const auto entry = static_.begin() + (std::next(newest).base() - static_frames_.begin());
    bytes_ -= entry->first.cdr.size();
    static_.erase(entry);
    static_frames_.erase(std::next(newest).base());
  }
  static_frames_.push_back(std::move(frames));
  keep(static_, message, index);
  if (static_.size() > kMostStatic) {
    drop_front(static_);
    static_frames_.pop_front();
  }
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
  for (const std::deque<Entry>* entries : {&static_, &moving_, &images_, &clock_})
    for (const Entry& entry : *entries) all.push_back(&entry);
  std::sort(all.begin(), all.end(), [](const Entry* a, const Entry* b) { return a->second < b->second; });
  for (const Entry* entry : all) PRESCENE_RETURN_IF_ERROR(take(entry->first, entry->second));
  return core::ok_status();
}

}  // namespace prescene::service
