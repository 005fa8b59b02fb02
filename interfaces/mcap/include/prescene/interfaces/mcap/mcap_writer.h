// SPDX-License-Identifier: Apache-2.0
// Writes MCAP recordings that rosbag2 and Foxglove open.
//
//   PRESCENE_TRY(auto writer, McapWriter::create("run.mcap", {}));
//   PRESCENE_TRY(const int depth, writer->add_channel(ros_channel("/camera/depth", "sensor_msgs/msg/Image")));
//   PRESCENE_RETURN_IF_ERROR(writer->write({depth, 0, log_time_ns, publish_time_ns, cdr}));
//   PRESCENE_RETURN_IF_ERROR(writer->close());
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>

#include "prescene/core/status.h"
#include "prescene/interfaces/mcap/mcap.h"

namespace prescene::interfaces {

struct McapWriterOptions {
  std::string profile = "ros2";
  McapCompression compression = McapCompression::kZstd;
  /// A chunk is closed when it is this large; what is in closed chunks survives a crash.
  std::size_t chunk_bytes = std::size_t{1} << 20;
  /// It is also closed when its log times span more than this, nanoseconds.
  std::int64_t chunk_ns = 1'000'000'000;
  /// How often the disk is asked to keep what is in closed chunks, so that they survive a power failure (see
  /// BackgroundSync); only close() waits for it. 0 = never: they survive a crash of the program.
  std::chrono::milliseconds sync_interval{0};
};

/// Not thread-safe. Every write to the file is checked: a full disk is kUnavailable, naming the file, and what
/// was in closed chunks stays readable. So is an error of the disk when it is to keep what was written.
class McapWriter {
 public:
  static core::Result<std::unique_ptr<McapWriter>> create(const std::filesystem::path& path,
                                                          const McapWriterOptions& options);
  /// Closes without reporting errors; call close() to get them.
  ~McapWriter();
  McapWriter(const McapWriter&) = delete;
  McapWriter& operator=(const McapWriter&) = delete;

  /// The number to give to messages. An equal channel gets the same number again.
  core::Result<int> add_channel(const McapChannel& channel);
  /// The message's channel is one that add_channel returned (checked). kInvalidInput for negative times.
  /// Where memory ends in the middle of it, the exception is passed on and the recording is as it was before.
  core::Status write(const McapMessage& message) { return write(message, message.data); }
  /// The same with the data from anywhere; those of `message` are not looked at.
  core::Status write(const McapMessage& message, std::span<const std::uint8_t> data);
  core::Status write_metadata(const McapMetadata& metadata);
  /// A file to carry along; readers need none of it to read the messages. kInvalidInput for negative times.
  core::Status write_attachment(const McapAttachment& attachment);
  /// Ends the current chunk and hands everything to the operating system.
  core::Status flush();
  /// The same if the chunk's earliest message is chunk_ns or more before this log time. What came last is otherwise
  /// kept back until the next message comes.
  core::Status flush_by(std::int64_t log_time_ns);
  /// How large the recording is by now; a reader's limits are those of McapReader.
  struct Size {
    std::uint64_t bytes = 0;        ///< In the file: without the chunk that is not closed, and the index.
    std::uint64_t index_bytes = 0;  ///< That the index of the chunks will take.
    std::uint64_t chunks = 0;
  };
  Size size() const;
  /// How long ago the oldest of what was handed over and is not known to be on the disk was, s; 0 without
  /// sync_interval.
  double seconds_at_risk() const;
  /// Writes the index, statistics and footer. Nothing can be written afterwards. Throws nothing: where memory ends, it
  /// is kResourceExhausted, and the file ends as one that was cut.
  core::Status close();

 private:
  struct Impl;
  explicit McapWriter(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// The key of a channel's metadata under which rosbag2 looks for the qualities of service to play it with.
inline constexpr const char* kOfferedQosKey = "offered_qos_profiles";
/// The text under that key, in YAML as up to version 8 of rosbag2's metadata, which later ones read, too: one profile,
/// reliable and without deadlines; `is_latched`: offered to readers that come later, too.
std::string offered_qos_profiles(bool is_latched);

/// The channel of a ROS 2 type of ros_messages/schemas.h (checked), with rosbag2's metadata and the type's hash.
McapChannel ros_channel(const std::string& topic, const std::string& type, bool is_latched = false);

}  // namespace prescene::interfaces
