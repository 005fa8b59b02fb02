// SPDX-License-Identifier: Apache-2.0
#include "mcap_records.h"

#include <bit>
#include <cstring>

#include "prescene/core/check.h"
#include "prescene/interfaces/bytes/byte_reader.h"
#include "prescene/interfaces/bytes/crc32.h"

namespace prescene::interfaces::mcap_records {
namespace {

std::string read_string(ByteReader* in) {
  const std::span<const std::uint8_t> raw = in->take(in->read<std::uint32_t>());
  return {reinterpret_cast<const char*>(raw.data()), raw.size()};
}

/// The part of `in` that a 32-bit byte length announces.
ByteReader read_block(ByteReader* in) { return ByteReader(in->take(in->read<std::uint32_t>())); }

bool read_texts(ByteReader* in, std::map<std::string, std::string>* out) {
  ByteReader block = read_block(in);
  while (block.ok() && block.remaining() > 0) {
    std::string key = read_string(&block);
    (*out)[std::move(key)] = read_string(&block);
  }
  return in->ok() && block.ok();
}

bool read_counts(ByteReader* in, std::map<std::uint16_t, std::uint64_t>* out) {
  ByteReader block = read_block(in);
  while (block.ok() && block.remaining() > 0) {
    const auto key = block.read<std::uint16_t>();
    (*out)[key] = block.read<std::uint64_t>();
  }
  return in->ok() && block.ok();
}

template <class T>
void put(T value, Bytes* out) {
  std::uint8_t raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  for (std::size_t i = 0; i < sizeof(T); ++i) {
    out->push_back(raw[std::endian::native == std::endian::little ? i : sizeof(T) - 1 - i]);
  }
}

void put_bytes(std::span<const std::uint8_t> bytes, Bytes* out) { out->insert(out->end(), bytes.begin(), bytes.end()); }

void put_string(const std::string& text, Bytes* out) {
  PRESCENE_CHECK(text.size() <= 0xffffffffU);
  put(static_cast<std::uint32_t>(text.size()), out);
  out->insert(out->end(), text.begin(), text.end());
}

/// Writes what `body` appends, with its length as `Length` before it.
template <class Length, class Body>
void put_block(Bytes* out, Body body) {
  const std::size_t place = out->size();
  put(Length{0}, out);
  const std::size_t begin = out->size();
  body();
  const auto length = static_cast<Length>(out->size() - begin);
  Bytes raw;
  put(length, &raw);
  std::copy(raw.begin(), raw.end(), out->begin() + static_cast<std::ptrdiff_t>(place));
}

template <class Body>
void put_record(Op op, Bytes* out, Body body) {
  out->push_back(static_cast<std::uint8_t>(op));
  put_block<std::uint64_t>(out, body);
}

void put_texts(const std::map<std::string, std::string>& texts, Bytes* out) {
  put_block<std::uint32_t>(out, [&] {
    for (const auto& [key, value] : texts) {
      put_string(key, out);
      put_string(value, out);
    }
  });
}

void put_counts(const std::map<std::uint16_t, std::uint64_t>& counts, Bytes* out) {
  put_block<std::uint32_t>(out, [&] {
    for (const auto& [key, value] : counts) {
      put(key, out);
      put(value, out);
    }
  });
}

}  // namespace

bool parse(std::span<const std::uint8_t> content, Header* out) {
  ByteReader in(content);
  out->profile = read_string(&in);
  out->library = read_string(&in);
  return in.ok();
}

bool parse(std::span<const std::uint8_t> content, Footer* out) {
  ByteReader in(content);
  out->summary_start = in.read<std::uint64_t>();
  out->summary_offset_start = in.read<std::uint64_t>();
  out->summary_crc = in.read<std::uint32_t>();
  return in.ok();
}

bool parse(std::span<const std::uint8_t> content, Schema* out) {
  ByteReader in(content);
  out->id = in.read<std::uint16_t>();
  out->schema.name = read_string(&in);
  out->schema.encoding = read_string(&in);
  out->schema.data = read_string(&in);
  return in.ok() && out->id != 0;
}

bool parse(std::span<const std::uint8_t> content, Channel* out) {
  ByteReader in(content);
  out->id = in.read<std::uint16_t>();
  out->schema_id = in.read<std::uint16_t>();
  out->topic = read_string(&in);
  out->message_encoding = read_string(&in);
  out->metadata.clear();
  return read_texts(&in, &out->metadata);
}

bool parse(std::span<const std::uint8_t> content, MessageHead* out) {
  ByteReader in(content);
  out->channel_id = in.read<std::uint16_t>();
  out->sequence = in.read<std::uint32_t>();
  out->log_time = in.read<std::uint64_t>();
  out->publish_time = in.read<std::uint64_t>();
  return in.ok();
}

bool parse(std::span<const std::uint8_t> content, ChunkHead* out) {
  ByteReader in(content);
  out->start_time = in.read<std::uint64_t>();
  out->end_time = in.read<std::uint64_t>();
  out->uncompressed_size = in.read<std::uint64_t>();
  out->uncompressed_crc = in.read<std::uint32_t>();
  out->compression = read_string(&in);
  out->records_size = in.read<std::uint64_t>();
  return in.ok();
}

bool parse(std::span<const std::uint8_t> content, ChunkIndex* out) {
  ByteReader in(content);
  out->start_time = in.read<std::uint64_t>();
  out->end_time = in.read<std::uint64_t>();
  out->chunk_offset = in.read<std::uint64_t>();
  out->chunk_length = in.read<std::uint64_t>();
  out->message_index_offsets.clear();
  if (!read_counts(&in, &out->message_index_offsets)) return false;
  out->message_index_length = in.read<std::uint64_t>();
  out->compression = read_string(&in);
  out->compressed_size = in.read<std::uint64_t>();
  out->uncompressed_size = in.read<std::uint64_t>();
  return in.ok();
}

bool parse(std::span<const std::uint8_t> content, Statistics* out) {
  ByteReader in(content);
  out->message_count = in.read<std::uint64_t>();
  out->schema_count = in.read<std::uint16_t>();
  out->channel_count = in.read<std::uint32_t>();
  out->attachment_count = in.read<std::uint32_t>();
  out->metadata_count = in.read<std::uint32_t>();
  out->chunk_count = in.read<std::uint32_t>();
  out->start_time = in.read<std::uint64_t>();
  out->end_time = in.read<std::uint64_t>();
  out->channel_message_counts.clear();
  return read_counts(&in, &out->channel_message_counts);
}

bool parse(std::span<const std::uint8_t> content, McapMetadata* out) {
  ByteReader in(content);
  out->name = read_string(&in);
  out->values.clear();
  return read_texts(&in, &out->values);
}

bool parse(std::span<const std::uint8_t> content, AttachmentHead* out) {
  ByteReader in(content);
  out->log_time = in.read<std::uint64_t>();
  out->create_time = in.read<std::uint64_t>();
  out->name = read_string(&in);
  out->media_type = read_string(&in);
  out->data_size = in.read<std::uint64_t>();
  return in.ok();
}

void append(const Header& record, Bytes* out) {
  put_record(Op::kHeader, out, [&] {
    put_string(record.profile, out);
    put_string(record.library, out);
  });
}

void append(const Footer& record, Bytes* out) {
  put_record(Op::kFooter, out, [&] {
    put(record.summary_start, out);
    put(record.summary_offset_start, out);
    put(record.summary_crc, out);
  });
}

void append(const Schema& record, Bytes* out) {
  put_record(Op::kSchema, out, [&] {
    put(record.id, out);
    put_string(record.schema.name, out);
    put_string(record.schema.encoding, out);
    put_string(record.schema.data, out);
  });
}

void append(const Channel& record, Bytes* out) {
  put_record(Op::kChannel, out, [&] {
    put(record.id, out);
    put(record.schema_id, out);
    put_string(record.topic, out);
    put_string(record.message_encoding, out);
    put_texts(record.metadata, out);
  });
}

void append(const MessageHead& head, std::span<const std::uint8_t> data, Bytes* out) {
  put_record(Op::kMessage, out, [&] {
    put(head.channel_id, out);
    put(head.sequence, out);
    put(head.log_time, out);
    put(head.publish_time, out);
    put_bytes(data, out);
  });
}

void append(const ChunkHead& head, std::span<const std::uint8_t> records, Bytes* out) {
  put_record(Op::kChunk, out, [&] {
    put(head.start_time, out);
    put(head.end_time, out);
    put(head.uncompressed_size, out);
    put(head.uncompressed_crc, out);
    put_string(head.compression, out);
    put(static_cast<std::uint64_t>(records.size()), out);
    put_bytes(records, out);
  });
}

void append(const MessageIndex& record, Bytes* out) {
  put_record(Op::kMessageIndex, out, [&] {
    put(record.channel_id, out);
    put_block<std::uint32_t>(out, [&] {
      for (const auto& [log_time, offset] : record.entries) {
        put(log_time, out);
        put(offset, out);
      }
    });
  });
}

void append(const ChunkIndex& record, Bytes* out) {
  put_record(Op::kChunkIndex, out, [&] {
    put(record.start_time, out);
    put(record.end_time, out);
    put(record.chunk_offset, out);
    put(record.chunk_length, out);
    put_counts(record.message_index_offsets, out);
    put(record.message_index_length, out);
    put_string(record.compression, out);
    put(record.compressed_size, out);
    put(record.uncompressed_size, out);
  });
}

void append(const Statistics& record, Bytes* out) {
  put_record(Op::kStatistics, out, [&] {
    put(record.message_count, out);
    put(record.schema_count, out);
    put(record.channel_count, out);
    put(record.attachment_count, out);
    put(record.metadata_count, out);
    put(record.chunk_count, out);
    put(record.start_time, out);
    put(record.end_time, out);
    put_counts(record.channel_message_counts, out);
  });
}

void append(const McapMetadata& record, Bytes* out) {
  put_record(Op::kMetadata, out, [&] {
    put_string(record.name, out);
    put_texts(record.values, out);
  });
}

void append(const MetadataIndex& record, Bytes* out) {
  put_record(Op::kMetadataIndex, out, [&] {
    put(record.offset, out);
    put(record.length, out);
    put_string(record.name, out);
  });
}

void append(const AttachmentHead& head, std::span<const std::uint8_t> data, Bytes* out) {
  put_record(Op::kAttachment, out, [&] {
    const std::size_t begin = out->size();
    put(head.log_time, out);
    put(head.create_time, out);
    put_string(head.name, out);
    put_string(head.media_type, out);
    put(static_cast<std::uint64_t>(data.size()), out);
    put_bytes(data, out);
    put(crc32(std::span(*out).subspan(begin)), out);
  });
}

void append(const AttachmentIndex& record, Bytes* out) {
  put_record(Op::kAttachmentIndex, out, [&] {
    put(record.offset, out);
    put(record.length, out);
    put(record.head.log_time, out);
    put(record.head.create_time, out);
    put(record.head.data_size, out);
    put_string(record.head.name, out);
    put_string(record.head.media_type, out);
  });
}

void append_data_end(std::uint32_t data_section_crc, Bytes* out) {
  put_record(Op::kDataEnd, out, [&] { put(data_section_crc, out); });
}

void append_summary_offset(Op op, std::uint64_t group_start, std::uint64_t group_length, Bytes* out) {
  put_record(Op::kSummaryOffset, out, [&] {
    put(static_cast<std::uint8_t>(op), out);
    put(group_start, out);
    put(group_length, out);
  });
}

bool RecordWalk::next() {
  ByteReader in(rest_);
  const auto op = in.read<std::uint8_t>();
  const auto length = in.read<std::uint64_t>();
  if (!in.ok() || op == 0 || length > in.remaining()) return false;
  op_ = static_cast<Op>(op);
  content_ = in.take(length);
  rest_ = rest_.subspan(in.position());
  return true;
}

}  // namespace prescene::interfaces::mcap_records
