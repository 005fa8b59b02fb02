// SPDX-License-Identifier: Apache-2.0
// What ROS 2 and Prescene record, as one stream of messages: an MCAP file, an SQLite file (.db3), or a folder of either
// as rosbag2 writes it, with metadata.yaml.
//
//   PRESCENE_TRY(auto reader, BagReader::open("run"));          // "run.mcap", "run_0.db3"
//   while (true) {
//     PRESCENE_TRY(auto message, reader->next());
//     if (!message) break;
//     ... reader->channels()[message->channel].topic, *message
//   }
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "prescene/core/status.h"
#include "prescene/interfaces/mcap/mcap_reader.h"

namespace prescene::interfaces {

/// Whether a path names what BagReader reads: a folder with a metadata.yaml of rosbag2 or with .mcap or .db3 files, or
/// any file. (A folder of images is no bag.)
bool is_bag(const std::filesystem::path& path);

struct BagReaderOptions {
  bool salvage = false;    ///< As McapReaderOptions; of a .db3, messages that can't be read are left out and counted.
  bool check_data = true;  ///< The same. A .db3 has no checksums.
};

/// Not thread-safe. Files of a folder are read one after another, in the order of its metadata. Memory: that of one
/// McapReader; of a .db3 one message (at most 256 MiB) and 16 MiB. Nothing is written beside a file, but by SQLite its
/// "-shm" where a "-wal" file shows that the recorder did not end well.
class BagReader {
 public:
  /// Errors of McapReader::open for MCAP files. For the others: kNotFound (no such file), kInvalidInput (no bag, no
  /// rosbag2 schema, or metadata that make no sense), kUnsupported (a bag that is compressed as a whole), kDataLoss
  /// (cut or damaged), kResourceExhausted (more than 65,535 topics or 10,000 files, or a message above 256 MiB).
  static core::Result<std::unique_ptr<BagReader>> open(const std::filesystem::path& path,
                                                       const BagReaderOptions& options = {});
  ~BagReader();
  BagReader(const BagReader&) = delete;
  BagReader& operator=(const BagReader&) = delete;

  /// "mcap", "sqlite3".
  const std::string& storage() const;
  /// The files that it is made of.
  const std::vector<std::filesystem::path>& files() const;
  /// Grows when the next file begins, and while a cut one is read. A .db3 has no schemas; their names are the types.
  /// Types in CDR have their names of ROS 2: where a file says sensor_msgs/Image, it is sensor_msgs/msg/Image here.
  const std::vector<McapChannel>& channels() const;
  /// As metadata.yaml says, or the file itself; nothing where neither does.
  std::optional<std::uint64_t> message_count() const;
  /// Of a single MCAP file; else empty.
  std::vector<McapMetadata> metadata() const;
  std::vector<McapReader::AttachedFile> attachments() const;
  /// As McapReader::attachment; kNotFound in other recordings.
  core::Result<McapAttachment> attachment(const std::string& name) const;

  /// The next message: in the order of time within a file, as McapReader::next. In a .db3 both times are when it was
  /// received. Topics of a .db3 that are not in CDR are left out and named in loss_text().
  core::Result<std::optional<McapMessage>> next();
  /// What could not be read, and what could not be checked: a sentence each, empty = nothing. Complete at the end.
  std::string loss_text() const;
  std::string unchecked_text() const;

 private:
  struct Impl;
  explicit BagReader(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace prescene::interfaces
