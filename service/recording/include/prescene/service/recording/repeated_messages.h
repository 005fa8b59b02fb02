// SPDX-License-Identifier: Apache-2.0
// What of the robot's messages the first frames of a new file of a recording need, kept while it is recorded.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <string>
#include <utility>

#include "prescene/interfaces/dds/dds_node.h"
#include "prescene/service/tracking/frame_assembler.h"
#include "prescene/service/tracking/topics.h"

namespace prescene::service {

/// Not thread-safe. Where a call throws (there is no memory), what was noted before stays.
class RepeatedMessages {
 public:
  /// Of messages that are kept: of what is too much, the oldest goes.
  static constexpr std::size_t kMostBytes = std::size_t{128} << 20;

  /// `tf_static`: the topic of the static transforms.
  explicit RepeatedMessages(std::string tf_static = InputTopics{}.tf_static) : tf_static_(std::move(tf_static)) {}
  /// A message of the robot under its number, which ascends.
  void note(const interfaces::ReceivedMessage& message, MessageIndex index);
  /// Images and simulated time before this number are not needed any more. Before the first call, no images are.
  void need_images_from(MessageIndex index);
  /// All that a new file needs, in the order of their numbers: the transforms and joint states of the last 10 s, static
  /// transforms (of messages between the same frames the first, which decides about a frame that gets two parents, and
  /// the newest), the newest camera info of each topic and the newest settings, and images. Stops at an error.
  core::Status each(
      const std::function<core::Status(const interfaces::ReceivedMessage& message, MessageIndex index)>& take) const;
  std::size_t bytes() const { return bytes_; }
  /// Messages that went for want of room, since the start.
  std::uint64_t dropped() const { return dropped_; }

 private:
  using Entry = std::pair<interfaces::ReceivedMessage, MessageIndex>;
  struct Static {
    Entry entry;
    std::string frames;  // between which its transforms are; "" = it is refused, at least in part
  };
  void keep(std::deque<Entry>& in, const interfaces::ReceivedMessage& message, MessageIndex index);
  void drop_front(std::deque<Entry>& from);
  void drop_static(std::size_t number);
  void note_static(const interfaces::ReceivedMessage& message, MessageIndex index);

  std::string tf_static_;
  std::map<std::string, std::deque<Entry>> newest_;  // by topic: camera infos, settings
  std::deque<Static> static_;                        // transforms
  std::deque<Entry> moving_;                         // transforms and joint states
  std::deque<Entry> images_;
  std::deque<Entry> clock_;
  bool needs_images_ = false;
  std::size_t bytes_ = 0;
  std::uint64_t dropped_ = 0;
};

}  // namespace prescene::service
