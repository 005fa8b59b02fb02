// SPDX-License-Identifier: Apache-2.0
// Reads MCAP recordings: by their index when they have one, front to back when they were cut. A recording is compared
// with every checksum that it holds, and refused where one is wrong or a record makes no sense; on request, what is
// sound of it is read, and what was left out is counted. A recording that was cut is read to its last whole record.
// Lengths that a file claims are bounded before memory is taken.
//
//   PRESCENE_TRY(auto reader, McapReader::open("run.mcap"));
//   while (true) {
//     PRESCENE_TRY(auto message, reader->next());
//     if (!message) break;
//     ... reader->channels()[message->channel].topic, *message
//   }
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "prescene/core/status.h"
#include "prescene/interfaces/mcap/mcap.h"

namespace prescene::interfaces {

struct McapReaderOptions {
  std::set<std::string> topics = {};          ///< Empty: all.
  std::optional<std::int64_t> begin_ns = {};  ///< Log times in [begin_ns, end_ns).
  std::optional<std::int64_t> end_ns = {};
  /// Larger (uncompressed) chunks are refused. Recorders make chunks of 1 to 4 MiB; a message that is larger, such as
  /// an image, is a chunk of its own.
  std::size_t max_chunk_bytes = std::size_t{128} << 20;
  /// Read what is sound of a damaged recording instead of refusing it.
  bool salvage = false;
  /// Compare the checksum of the data section, which reads the whole file once. Without it, damage outside of chunks
  /// (to metadata, for instance) is not noticed: only for a file that was checked a moment ago.
  bool check_data = true;
};

/// What could not be read.
struct McapLoss {
  bool truncated = false;            ///< No footer: the file was cut or is still being written.
  bool damaged_header = false;       ///< The first record is wrong; its profile is not known.
  bool bad_index = false;            ///< There is an index, but it is wrong; read front to back instead.
  bool damaged_data = false;         ///< The checksum of the data section is wrong.
  std::uint64_t lost_bytes = 0;      ///< After the last whole record; of a cut chunk those of its unpacked content.
  std::uint64_t damaged_chunks = 0;  ///< Left out for a wrong checksum, or read to their last sound record.
  std::uint64_t refused_chunks = 0;  ///< Left out as larger than max_chunk_bytes.
  std::uint64_t stray_messages = 0;  ///< Left out as their channel is not known.
  std::string unknown_compression;   ///< Of damaged_chunks that were left out for it.
  bool nothing() const { return *this == McapLoss{}; }
  /// One sentence for a person; empty when nothing was lost.
  std::string text() const;
  friend bool operator==(const McapLoss&, const McapLoss&) = default;
};

/// What carries no checksum, so that damage to it can't be noticed. (A recording that was cut has lost the checksum of
/// its data section with its end, see McapLoss::truncated.)
struct McapUnchecked {
  bool data = false;         ///< The data section: what is outside of chunks, as metadata.
  bool index = false;        ///< The summary.
  std::uint64_t chunks = 0;  ///< Of those that were read.
  bool nothing() const { return *this == McapUnchecked{}; }
  /// One sentence for a person; empty when all has its checksum.
  std::string text() const;
  friend bool operator==(const McapUnchecked&, const McapUnchecked&) = default;
};

/// Not thread-safe. Memory is bounded by the chunks that overlap in time, together at most max_chunk_bytes (then the
/// order of time is given up before memory is), and what is kept of each chunk (at most 2^20, some 150 bytes each),
/// schemas, channels and metadata (at most 64 MiB, 64 MiB and 20 MiB as stored); not by the file.
class McapReader {
 public:
  /// Fails with kNotFound (no such file), kInvalidInput (not an MCAP file), kDataLoss (nothing readable, or damaged),
  /// kResourceExhausted (it would take too much memory).
  static core::Result<std::unique_ptr<McapReader>> open(const std::filesystem::path& path,
                                                        const McapReaderOptions& options = {});
  /// The same from memory.
  static core::Result<std::unique_ptr<McapReader>> open_bytes(std::vector<std::uint8_t> bytes,
                                                              const McapReaderOptions& options = {});
  ~McapReader();
  McapReader(const McapReader&) = delete;
  McapReader& operator=(const McapReader&) = delete;

  const std::string& profile() const;
  /// Grows while a cut file is read.
  const std::vector<McapChannel>& channels() const;
  const std::vector<McapMetadata>& metadata() const;
  /// A file that the recording carries, and how many bytes it claims.
  struct AttachedFile {
    std::string name;
    std::string media_type;
    std::uint64_t bytes = 0;
  };
  /// In the order of the file.
  std::vector<AttachedFile> attachments() const;
  /// The content of the attachment of this name (of the last, where several have it). kNotFound where there is none,
  /// kResourceExhausted above `max_bytes`, kDataLoss where its checksum is wrong.
  core::Result<McapAttachment> attachment(const std::string& name,
                                          std::size_t max_bytes = std::size_t{256} << 20) const;

  /// What the file says of its messages; nothing where it has no statistics, as one that was cut.
  struct Statistics {
    std::int64_t first_ns = 0, last_ns = 0;  ///< Earliest and latest log time; 0 without messages.
    std::uint64_t messages = 0;
    std::vector<std::uint64_t> by_channel;  ///< As channels().
  };
  std::optional<Statistics> statistics() const;
  /// Messages in the file if it has statistics.
  std::optional<std::uint64_t> message_count() const;

  /// The next message in the order of log time (of position in the file among equals, or throughout a file without
  /// index); empty at the end. Fails with kDataLoss at a damaged chunk, with kUnsupported at one of an unknown
  /// compression and with kResourceExhausted at one that is too large; these are left out and counted with `salvage`.
  /// Times beyond 2^63 ns read as 2^63 - 1.
  core::Result<std::optional<McapMessage>> next();
  /// Complete once next() has returned the end.
  const McapLoss& loss() const;
  const McapUnchecked& unchecked() const;

 private:
  struct Impl;
  explicit McapReader(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace prescene::interfaces
