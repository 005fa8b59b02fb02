// SPDX-License-Identifier: Apache-2.0
// What lies where in a recording, found without unpacking anything.
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <vector>

#include "mcap_records.h"
#include "mcap_source.h"
#include "prescene/core/status.h"
#include "prescene/interfaces/mcap/mcap_reader.h"

namespace prescene::interfaces {

/// A chunk, or a run of messages (and their schemas and channels) outside of chunks.
struct McapSegment {
  bool chunk = false;
  bool cut = false;          ///< The chunk's stored records end before they should.
  std::uint64_t offset = 0;  ///< Of the stored records of a chunk; of the first record of a run.
  std::uint64_t length = 0;  ///< Bytes there.
  std::uint64_t start_time = 0;
  std::uint64_t end_time = 0;
  mcap_records::ChunkHead head;         ///< Of a chunk.
  std::set<std::uint16_t> channel_ids;  ///< Of a chunk by the index; empty when not known.
};

struct McapLayout {
  mcap_records::Header header;
  /// The channels of the whole file are known from its summary, so that segments may be read in any order.
  bool indexed = false;
  std::vector<mcap_records::Schema> schemas;    ///< Of the summary.
  std::vector<mcap_records::Channel> channels;  ///< Of the summary.
  std::optional<mcap_records::Statistics> statistics;
  std::vector<McapMetadata> metadata;
  std::vector<McapSegment> segments;  ///< In the order of the file.
  McapLoss loss;                      ///< As far as it can be seen from outside of the chunks.
};

/// kInvalidInput when it is no MCAP file, kDataLoss when nothing can be read, errors of the source.
core::Result<McapLayout> find_layout(McapSource* source);

}  // namespace prescene::interfaces
