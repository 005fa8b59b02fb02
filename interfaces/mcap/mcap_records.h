// SPDX-License-Identifier: Apache-2.0
// The records of the MCAP format (specification of version 0): their fields, from and to bytes. All integers little
// endian; a record is an opcode, a 64-bit length and that many bytes of content.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "prescene/interfaces/mcap/mcap.h"

namespace prescene::interfaces::mcap_records {

constexpr std::array<std::uint8_t, 8> kMagic = {0x89, 'M', 'C', 'A', 'P', '0', '\r', '\n'};
constexpr std::size_t kFrameBytes = 9;  ///< Opcode and length before each record's content.

enum class Op : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kAttachment = 0x09,
  kAttachmentIndex = 0x0a,
  kStatistics = 0x0b,
  kMetadata = 0x0c,
  kMetadataIndex = 0x0d,
  kSummaryOffset = 0x0e,
  kDataEnd = 0x0f,
};

struct Header {
  std::string profile;
  std::string library;
};

struct Footer {
  static constexpr std::size_t kContentBytes = 20;
  std::uint64_t summary_start = 0;  ///< 0: there is no summary.
  std::uint64_t summary_offset_start = 0;
  std::uint32_t summary_crc = 0;  ///< 0: not given.
};

struct Schema {
  std::uint16_t id = 0;  ///< Never 0.
  McapSchema schema;
};

struct Channel {
  std::uint16_t id = 0;
  std::uint16_t schema_id = 0;  ///< 0: none.
  std::string topic;
  std::string message_encoding;
  std::map<std::string, std::string> metadata;
};

/// What stands before the data of a message.
struct MessageHead {
  static constexpr std::size_t kBytes = 22;
  std::uint16_t channel_id = 0;
  std::uint32_t sequence = 0;
  std::uint64_t log_time = 0;
  std::uint64_t publish_time = 0;
};

/// What stands before the records of a chunk.
struct ChunkHead {
  static constexpr std::size_t kBytesBeforeName = 32;  ///< With the length of the compression's name.
  static constexpr std::size_t kMaxNameBytes = 32;
  std::uint64_t start_time = 0;
  std::uint64_t end_time = 0;
  std::uint64_t uncompressed_size = 0;
  std::uint32_t uncompressed_crc = 0;  ///< 0: not given.
  std::string compression;
  std::uint64_t records_size = 0;  ///< As stored.
  std::size_t bytes() const { return kBytesBeforeName + compression.size() + 8; }
};

struct ChunkIndex {
  std::uint64_t start_time = 0;
  std::uint64_t end_time = 0;
  std::uint64_t chunk_offset = 0;
  std::uint64_t chunk_length = 0;  ///< With the frame.
  std::map<std::uint16_t, std::uint64_t> message_index_offsets;
  std::uint64_t message_index_length = 0;
  std::string compression;
  std::uint64_t compressed_size = 0;
  std::uint64_t uncompressed_size = 0;
};

struct MessageIndex {
  std::uint16_t channel_id = 0;
  std::vector<std::pair<std::uint64_t, std::uint64_t>> entries;  ///< Log time, offset in the uncompressed chunk.
};

struct Statistics {
  std::uint64_t message_count = 0;
  std::uint16_t schema_count = 0;
  std::uint32_t channel_count = 0;
  std::uint32_t attachment_count = 0;
  std::uint32_t metadata_count = 0;
  std::uint32_t chunk_count = 0;
  std::uint64_t start_time = 0;
  std::uint64_t end_time = 0;
  std::map<std::uint16_t, std::uint64_t> channel_message_counts;
};

/// What stands before the data of an attachment; a checksum of all before it follows the data.
struct AttachmentHead {
  static constexpr std::size_t kBytesBesideTexts = 32;  ///< Two times and three lengths.
  static constexpr std::size_t kChecksumBytes = 4;
  std::uint64_t log_time = 0;
  std::uint64_t create_time = 0;
  std::string name;
  std::string media_type;
  std::uint64_t data_size = 0;
  std::size_t bytes() const { return kBytesBesideTexts + name.size() + media_type.size(); }
};

struct AttachmentIndex {
  std::uint64_t offset = 0;
  std::uint64_t length = 0;  ///< With the frame.
  AttachmentHead head;
};

struct MetadataIndex {
  std::uint64_t offset = 0;
  std::uint64_t length = 0;
  std::string name;
};

// From a record's content; false when it does not fit. Bytes after the last field are allowed, as the format asks.
bool parse(std::span<const std::uint8_t> content, Header* out);
bool parse(std::span<const std::uint8_t> content, Footer* out);
bool parse(std::span<const std::uint8_t> content, Schema* out);
bool parse(std::span<const std::uint8_t> content, Channel* out);
bool parse(std::span<const std::uint8_t> content, MessageHead* out);
/// Needs the head only, not the records after it.
bool parse(std::span<const std::uint8_t> content, ChunkHead* out);
bool parse(std::span<const std::uint8_t> content, ChunkIndex* out);
bool parse(std::span<const std::uint8_t> content, Statistics* out);
bool parse(std::span<const std::uint8_t> content, McapMetadata* out);
/// Needs the head only.
bool parse(std::span<const std::uint8_t> content, AttachmentHead* out);

// A whole record, appended.
using Bytes = std::vector<std::uint8_t>;
void append(const Header& record, Bytes* out);
void append(const Footer& record, Bytes* out);
void append(const Schema& record, Bytes* out);
void append(const Channel& record, Bytes* out);
void append(const MessageHead& head, std::span<const std::uint8_t> data, Bytes* out);
void append(const ChunkHead& head, std::span<const std::uint8_t> records, Bytes* out);
void append(const MessageIndex& record, Bytes* out);
void append(const ChunkIndex& record, Bytes* out);
void append(const Statistics& record, Bytes* out);
void append(const McapMetadata& record, Bytes* out);
void append(const MetadataIndex& record, Bytes* out);
void append(const AttachmentHead& head, std::span<const std::uint8_t> data, Bytes* out);
void append(const AttachmentIndex& record, Bytes* out);
void append_data_end(std::uint32_t data_section_crc, Bytes* out);
void append_summary_offset(Op op, std::uint64_t group_start, std::uint64_t group_length, Bytes* out);

/// Takes records one after another off bytes in memory.
class RecordWalk {
 public:
  explicit RecordWalk(std::span<const std::uint8_t> bytes) : rest_(bytes), size_(bytes.size()) {}

  /// False at the end, and at a record that does not fit into what is left (see whole()).
  bool next();
  Op op() const { return op_; }
  std::span<const std::uint8_t> content() const { return content_; }
  /// Where the bytes behind the last whole record begin.
  std::size_t position() const { return size_ - rest_.size(); }
  bool whole() const { return rest_.empty(); }

 private:
  std::span<const std::uint8_t> rest_;
  std::size_t size_;
  Op op_{};
  std::span<const std::uint8_t> content_;
};

}  // namespace prescene::interfaces::mcap_records
