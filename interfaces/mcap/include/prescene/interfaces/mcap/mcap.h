// SPDX-License-Identifier: Apache-2.0
// What MCAP recordings hold, in plain types (mcap.dev, specification of version 0).
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace prescene::interfaces {

enum class McapCompression { kNone, kLz4, kZstd };

/// How the messages of a channel are to be understood.
struct McapSchema {
  std::string name;      ///< "sensor_msgs/msg/Image"
  std::string encoding;  ///< "ros2msg", "jsonschema", ...
  std::string data;      ///< The schema's text or bytes.
  friend bool operator==(const McapSchema&, const McapSchema&) = default;
};

struct McapChannel {
  std::string topic;
  std::string message_encoding;  ///< "cdr", "json"
  McapSchema schema;             ///< Empty name = none.
  std::map<std::string, std::string> metadata;
  friend bool operator==(const McapChannel&, const McapChannel&) = default;
};

struct McapMessage {
  int channel = 0;  ///< As returned by add_channel, or index into McapReader::channels().
  std::uint32_t sequence = 0;
  std::int64_t log_time_ns = 0;      ///< When it was received.
  std::int64_t publish_time_ns = 0;  ///< When it was sent.
  std::vector<std::uint8_t> data;
  friend bool operator==(const McapMessage&, const McapMessage&) = default;
};

/// A named map of texts about the whole recording.
struct McapMetadata {
  std::string name;
  std::map<std::string, std::string> values;
  friend bool operator==(const McapMetadata&, const McapMetadata&) = default;
};

/// A file that the recording carries.
struct McapAttachment {
  std::string name;        ///< As a path, "meshes/cup.ply".
  std::string media_type;  ///< "application/yaml", "model/ply", "" = not said.
  std::vector<std::uint8_t> data;
  std::int64_t log_time_ns = 0;     ///< When it was recorded; 0 = not said.
  std::int64_t create_time_ns = 0;  ///< When it was made; 0 = not said.
  friend bool operator==(const McapAttachment&, const McapAttachment&) = default;
};

}  // namespace prescene::interfaces
