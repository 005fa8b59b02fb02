// SPDX-License-Identifier: Apache-2.0
#include "recordings.h"

#include "prescene/core/check.h"
#include "prescene/interfaces/bytes/file.h"
#include "tests/support/paths.h"

namespace prescene::tests {

using interfaces::McapReader;
using interfaces::McapWriter;

std::vector<TopicMessage> read_all(McapReader* reader) {
  std::vector<TopicMessage> out;
  for (;;) {
    auto message = reader->next();
    PRESCENE_CHECK_MSG(message.ok(), message.status().message());
    if (!*message) return out;
    const auto& channel = reader->channels().at(static_cast<std::size_t>((*message)->channel));
    out.push_back({channel.topic, (*message)->sequence, (*message)->log_time_ns, (*message)->publish_time_ns,
                   std::move((*message)->data)});
  }
}

std::vector<TopicMessage> read_all(Bytes bytes, const interfaces::McapReaderOptions& options) {
  auto reader = McapReader::open_bytes(std::move(bytes), options);
  if (!reader) return {};
  return read_all(reader->get());
}

std::vector<TopicMessage> random_messages(core::RandomStream* stream, std::size_t max_messages, std::size_t max_data) {
  std::vector<TopicMessage> messages(stream->uniform_below(max_messages + 1));
  std::int64_t time = static_cast<std::int64_t>(stream->uniform_below(1000));
  for (TopicMessage& message : messages) {
    message.topic = "/" + std::to_string(stream->uniform_below(4));
    message.sequence = stream->next_u32();
    time += static_cast<std::int64_t>(stream->uniform_below(100)) - 20;
    message.log_time_ns = std::max<std::int64_t>(time, 0);
    message.publish_time_ns = static_cast<std::int64_t>(stream->next_u64() >> 1);
    message.data.resize(stream->uniform_below(max_data + 1));
    for (auto& byte : message.data) byte = static_cast<std::uint8_t>(stream->uniform_below(4));
  }
  return messages;
}

interfaces::McapChannel channel_of(const std::string& topic) {
  if (topic == "/0") return {topic, "json", {}, {}};
  return {topic, "cdr", {"pkg/msg/Type" + topic.substr(1), "ros2msg", "uint8[] data\n"}, {{"key", topic}}};
}

Bytes record(const std::vector<TopicMessage>& messages, const interfaces::McapWriterOptions& options,
             const std::vector<interfaces::McapMetadata>& metadata) {
  const ScratchDir scratch;
  const auto path = scratch.path() / "a.mcap";
  auto writer = McapWriter::create(path, options);
  PRESCENE_CHECK(writer.ok());
  for (const TopicMessage& message : messages) {
    const auto channel = (*writer)->add_channel(channel_of(message.topic));
    PRESCENE_CHECK(channel.ok());
    PRESCENE_CHECK((*writer)
                       ->write({*channel, message.sequence, message.log_time_ns, message.publish_time_ns, message.data})
                       .ok());
  }
  for (const auto& entry : metadata) PRESCENE_CHECK((*writer)->write_metadata(entry).ok());
  PRESCENE_CHECK((*writer)->close().ok());
  return *interfaces::read_file(path, std::size_t{1} << 30);
}

void put_u16(std::uint16_t value, Bytes* out) {
  for (int shift = 0; shift < 16; shift += 8) out->push_back(static_cast<std::uint8_t>(value >> shift));
}
void put_u32(std::uint32_t value, Bytes* out) {
  for (int shift = 0; shift < 32; shift += 8) out->push_back(static_cast<std::uint8_t>(value >> shift));
}
void put_u64(std::uint64_t value, Bytes* out) {
  for (int shift = 0; shift < 64; shift += 8) out->push_back(static_cast<std::uint8_t>(value >> shift));
}
void put_text(std::string_view text, Bytes* out) {
  put_u32(static_cast<std::uint32_t>(text.size()), out);
  out->insert(out->end(), text.begin(), text.end());
}

Bytes hand_record(std::uint8_t op, const Bytes& content) {
  Bytes out;
  out.push_back(op);
  put_u64(content.size(), &out);
  out.insert(out.end(), content.begin(), content.end());
  return out;
}

Bytes joined(std::initializer_list<Bytes> parts) {
  Bytes out;
  for (const Bytes& part : parts) out.insert(out.end(), part.begin(), part.end());
  return out;
}

std::uint32_t bitwise_crc(const Bytes& bytes) {
  std::uint32_t crc = 0xffffffffU;
  for (const std::uint8_t byte : bytes) {
    crc ^= byte;
    for (int i = 0; i < 8; ++i) crc = (crc & 1U) != 0 ? crc >> 1 ^ 0xedb88320U : crc >> 1;
  }
  return ~crc;
}

Bytes magic() { return {0x89, 0x4d, 0x43, 0x41, 0x50, 0x30, 0x0d, 0x0a}; }

Bytes hand_header(std::string_view profile, std::string_view library) {
  Bytes content;
  put_text(profile, &content);
  put_text(library, &content);
  return hand_record(0x01, content);
}

Bytes hand_schema(std::uint16_t id, std::string_view name, std::string_view encoding, std::string_view data) {
  Bytes content;
  put_u16(id, &content);
  put_text(name, &content);
  put_text(encoding, &content);
  put_text(data, &content);
  return hand_record(0x03, content);
}

Bytes hand_channel(std::uint16_t id, std::uint16_t schema, std::string_view topic, std::string_view encoding) {
  Bytes content;
  put_u16(id, &content);
  put_u16(schema, &content);
  put_text(topic, &content);
  put_text(encoding, &content);
  put_u32(0, &content);
  return hand_record(0x04, content);
}

Bytes hand_message(std::uint16_t channel, std::uint64_t log_time, std::string_view data) {
  Bytes content;
  put_u16(channel, &content);
  put_u32(0, &content);
  put_u64(log_time, &content);
  put_u64(log_time, &content);
  content.insert(content.end(), data.begin(), data.end());
  return hand_record(0x05, content);
}

Bytes hand_chunk(std::uint64_t start, std::uint64_t end, const Bytes& records, std::uint32_t crc,
                 std::string_view compression) {
  Bytes content;
  put_u64(start, &content);
  put_u64(end, &content);
  put_u64(records.size(), &content);
  put_u32(crc, &content);
  put_text(compression, &content);
  put_u64(records.size(), &content);
  content.insert(content.end(), records.begin(), records.end());
  return hand_record(0x06, content);
}

}  // namespace prescene::tests
