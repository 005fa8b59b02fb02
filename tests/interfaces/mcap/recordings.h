// SPDX-License-Identifier: Apache-2.0
// Recordings for tests: written by the writer or laid out by hand, and read whole.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "prescene/core/random.h"
#include "prescene/interfaces/mcap/mcap_reader.h"
#include "prescene/interfaces/mcap/mcap_writer.h"

namespace prescene::tests {

using Bytes = std::vector<std::uint8_t>;

/// A message with the topic instead of a channel's number.
struct TopicMessage {
  std::string topic;
  std::uint32_t sequence = 0;
  std::int64_t log_time_ns = 0;
  std::int64_t publish_time_ns = 0;
  Bytes data;
  friend bool operator==(const TopicMessage&, const TopicMessage&) = default;
};

/// All that next() gives.
std::vector<TopicMessage> read_all(interfaces::McapReader* reader);
/// The same of bytes; empty when they cannot be opened.
std::vector<TopicMessage> read_all(Bytes bytes, const interfaces::McapReaderOptions& options = {});

/// Messages on topics /0 to /3 with times that mostly grow, data of up to `max_data` bytes that compress.
std::vector<TopicMessage> random_messages(core::RandomStream* stream, std::size_t max_messages, std::size_t max_data);
interfaces::McapChannel channel_of(const std::string& topic);
/// Writes to a file and gives its bytes. Aborts on errors.
Bytes record(const std::vector<TopicMessage>& messages, const interfaces::McapWriterOptions& options,
             const std::vector<interfaces::McapMetadata>& metadata = {});

// Records laid out by hand, from the specification alone.
void put_u16(std::uint16_t value, Bytes* out);
void put_u32(std::uint32_t value, Bytes* out);
void put_u64(std::uint64_t value, Bytes* out);
void put_text(std::string_view text, Bytes* out);
Bytes hand_record(std::uint8_t op, const Bytes& content);
Bytes joined(std::initializer_list<Bytes> parts);
/// CRC-32 bit by bit.
std::uint32_t bitwise_crc(const Bytes& bytes);

Bytes magic();
Bytes hand_header(std::string_view profile, std::string_view library);
Bytes hand_schema(std::uint16_t id, std::string_view name, std::string_view encoding, std::string_view data);
Bytes hand_channel(std::uint16_t id, std::uint16_t schema, std::string_view topic, std::string_view encoding);
Bytes hand_message(std::uint16_t channel, std::uint64_t log_time, std::string_view data);
/// An uncompressed chunk; `crc` 0 = not given.
Bytes hand_chunk(std::uint64_t start, std::uint64_t end, const Bytes& records, std::uint32_t crc = 0,
                 std::string_view compression = "");

}  // namespace prescene::tests
