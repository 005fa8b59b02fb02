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

/// Not thread-safe. Takes at most 128 MiB: of what is too much, the oldest goes.
class RepeatedMessages {
 public:
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

 private:
  using Entry = std::pair<interfaces::ReceivedMessage, MessageIndex>;
  void keep(std::deque<Entry>& in, const interfaces::ReceivedMessage& message, MessageIndex index);
  void drop_front(std::deque<Entry>& from);

  void note_static(const interfaces::ReceivedMessage& message, MessageIndex index);

  std::string tf_static_;
  std::map<std::string, std::deque<Entry>> newest_;  // by topic: camera infos, settings
  std::deque<Entry> static_;                         // transforms
  std::deque<std::string> static_frames_;            // of each of static_
  std::deque<Entry> moving_;                         // transforms and joint states
  std::deque<Entry> images_;
  std::deque<Entry> clock_;
  bool needs_images_ = false;
  std::size_t bytes_ = 0;
};

}  // namespace prescene::service
