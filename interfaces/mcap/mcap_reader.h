// SPDX-License-Identifier: Apache-2.0
// Reads MCAP recordings: by their index when they have one, front to back when they were cut.
//
//   PRESCENE_TRY(auto reader, McapReader::open("run.mcap"));
//   while (true) {
//     PRESCENE_TRY(auto message, reader->next());
//     if (!message) break;
//     use(reader->channels()[message->channel].topic, *message);
//   }
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <set>

#include "prescene/core/status.h"
#include "prescene/interfaces/mcap/mcap.h"

namespace prescene::interfaces {

struct McapReaderOptions {
  std::set<std::string> topics;                        ///< Empty: all.
  std::optional<std::int64_t> begin_ns;                ///< Log times in [begin_ns, end_ns).
  std::optional<std::int64_t> end_ns;
  std::size_t max_chunk_bytes = std::size_t{1} << 30;  ///< Larger (uncompressed) chunks are refused.
};

/// What could not be read.
struct McapLoss {
  bool truncated = false;            ///< No footer: the file was cut or is still being written.
  std::uint64_t lost_bytes = 0;      ///< At the end, after the last whole record.
  std::uint64_t damaged_chunks = 0;  ///< Whose checksum or content is wrong; left out.
  /// One sentence for a person; empty when nothing was lost.
  std::string text() const;
};

/// Not thread-safe. Memory is bounded by the largest chunk, not by the file.
class McapReader {
 public:
  /// Fails with kNotFound (no such file), kInvalidInput (not an MCAP file), kDataLoss (nothing readable).
  static core::Result<std::unique_ptr<McapReader>> open(const std::filesystem::path& path, const McapReaderOptions& options = {});
  ~McapReader();
  McapReader(const McapReader&) = delete;
  McapReader& operator=(const McapReader&) = delete;

  const std::string& profile() const;
  /// Grows while a cut file is read.
  const std::vector<McapChannel>& channels() const;
  const std::vector<McapMetadata>& metadata() const;
  /// Messages in the file if it has statistics.
  std::optional<std::uint64_t> message_count() const;

  /// The next message in the order of log time (of position in the file among equals, or throughout a cut file); empty at
  /// the end. Damaged chunks are skipped and counted.
  core::Result<std::optional<McapMessage>> next();
  /// Complete once next() has returned the end.
  const McapLoss& loss() const;

 private:
  struct Impl;
  explicit McapReader(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace prescene::interfaces
