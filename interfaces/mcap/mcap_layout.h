// SPDX-License-Identifier: Apache-2.0
// What lies where in a recording, found without unpacking anything.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "mcap_records.h"
#include "mcap_source.h"
#include "prescene/core/status.h"
#include "prescene/interfaces/mcap/mcap_reader.h"

namespace prescene::interfaces {

// What a recording may make us keep, whatever it claims. A recording of ours of a week stays below all of them.
constexpr std::uint64_t kMaxSummaryBytes = std::uint64_t{64} << 20;
constexpr std::uint64_t kMaxMetadataBytes = std::uint64_t{20}
                                            << 20;  ///< Of all metadata records: a scene file and more.
constexpr std::size_t kMaxSegments = std::size_t{1} << 20;
constexpr std::size_t kMaxDefinitionBytes = std::size_t{4} << 20;    ///< Of one schema or channel record.
constexpr std::size_t kMaxDefinitionsBytes = std::size_t{64} << 20;  ///< Of all schemas and channels, in memory.

/// How the errors about damage end.
constexpr const char* kDamageRemedy =
    " (a checksum or a record is wrong); copy it again, or read what is sound by `replay --salvage`";

/// A chunk, or a run of messages (and their schemas and channels) outside of chunks.
struct McapSegment {
  bool chunk = false;
  bool cut = false;          ///< The chunk's stored records end before they should.
  std::uint32_t crc = 0;     ///< Of a chunk's unpacked records; 0 = not given.
  std::uint64_t offset = 0;  ///< Of the stored records of a chunk; of the first record of a run.
  std::uint64_t length = 0;  ///< Bytes there.
  std::uint64_t unpacked_length = 0;
  std::uint64_t start_time = 0;
  std::uint64_t end_time = 0;
  std::string compression;                 ///< Its name, of a chunk.
  std::vector<std::uint16_t> channel_ids;  ///< Of a chunk by the index; empty when not known.
};

/// An attachment whose data are read when they are asked for.
struct McapStoredAttachment {
  mcap_records::AttachmentHead head;
  std::uint64_t offset = 0;  ///< Of the record's content.
  std::uint64_t length = 0;  ///< Of that content.
};

struct McapLayout {
  mcap_records::Header header;
  /// The channels of the whole file are known from its summary, so that segments may be read in any order.
  bool indexed = false;
  std::vector<mcap_records::Schema> schemas;    ///< Of the summary.
  std::vector<mcap_records::Channel> channels;  ///< Of the summary.
  std::optional<mcap_records::Statistics> statistics;
  std::vector<McapMetadata> metadata;
  std::vector<McapStoredAttachment> attachments;
  std::deque<McapSegment> segments;  ///< In the order of the file.
  McapLoss loss;                     ///< As far as it can be seen from outside of the chunks.
  McapUnchecked unchecked;           ///< The same.
};

/// kInvalidInput when it is no MCAP file, kDataLoss when nothing can be read or (unless `salvage`) something is
/// damaged, kResourceExhausted when it would take too much memory, errors of the source. `check_data`: compare the
/// checksum of the data section, which reads the whole file.
core::Result<McapLayout> find_layout(McapSource* source, bool salvage, bool check_data);

}  // namespace prescene::interfaces
