// SPDX-License-Identifier: Apache-2.0
// Recordings: MCAP files with the robot's messages as they came, and what Prescene did with them, as JSON under
// /prescene/.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "prescene/interfaces/dds/dds_node.h"
#include "prescene/interfaces/mcap/mcap_reader.h"
#include "prescene/interfaces/mcap/mcap_writer.h"
#include "prescene/service/tracking/step_record.h"

namespace prescene::service {

/// What a recording says about itself, in its metadata record "prescene", with a checksum: in a recording that was cut
/// there is no other.
struct RecordingInfo {
  std::string scene_file;  ///< Where the scene came from, as given; "" = not known.
  std::string scene_text;  ///< Its YAML.
  std::uint64_t seed = 0;
  std::string settings;  ///< JSON of the settings that were used; "" = none.
};

/// Where to record a robot: `path`, or where that is a file already, "run-2.mcap", "run-3.mcap", ... beside it. What a
/// robot saw can't be seen again, so nothing live is written over it.
std::filesystem::path unused_recording_path(const std::filesystem::path& path);

/// Writes one recording. Not thread-safe: owned by the thread that steps the belief.
class RecordingWriter {
 public:
  static core::Result<std::unique_ptr<RecordingWriter>> create(const std::filesystem::path& path,
                                                               const RecordingInfo& info);

  /// Messages of the robot; numbered 0, 1, ... in the order of these calls. Their times are clamped to 1970 and
  /// kLatestRecordedNs: a sender's clock may say anything. What ends in an exception is not in the recording, and has
  /// no number.
  core::Result<MessageIndex> write(const interfaces::ReceivedMessage& message);
  /// One JSON document on a /prescene/ topic. kResourceExhausted, writing nothing, above most_json_bytes().
  core::Status write_json(const std::string& topic, const std::string& json, core::TimeNs time_ns);
  core::Status flush() { return writer_->flush(); }
  core::Status close() { return writer_->close(); }

 private:
  explicit RecordingWriter(std::unique_ptr<interfaces::McapWriter> writer) : writer_(std::move(writer)) {}
  core::Status write(const interfaces::McapChannel& channel, std::uint32_t sequence, core::TimeNs log_ns,
                     core::TimeNs publish_ns, std::vector<std::uint8_t> data);

  std::unique_ptr<interfaces::McapWriter> writer_;
  std::map<std::string, int> channels_;
  std::map<std::string, std::uint32_t> sequences_;
  MessageIndex next_index_ = 0;
};

/// One entry of a recording in its order.
struct RecordedEntry {
  interfaces::ReceivedMessage message;  ///< `cdr` holds the JSON text of entries that are JSON.
  bool is_json = false;
  /// Of a robot message, as when it was written, whatever was lost before it. In a recording of another program,
  /// or one whose description is damaged: its place among those that are read.
  MessageIndex index = 0;
};

struct RecordingReadOptions {
  bool salvage = false;    ///< As interfaces::McapReaderOptions.
  bool check_data = true;  ///< The same.
};

class RecordingReader {
 public:
  /// Errors of McapReader::open; kDataLoss where the checksum of what it says about itself is wrong or missing (with
  /// `salvage`, that is left out).
  static core::Result<std::unique_ptr<RecordingReader>> open(const std::filesystem::path& path,
                                                             const RecordingReadOptions& options = {});

  /// From the recording's metadata; defaults where it has none (a recording made by other tools).
  const RecordingInfo& info() const { return info_; }
  /// In the order of log times; empty at the end. Errors of McapReader::next; kResourceExhausted for JSON that would be
  /// parsed and is longer than kMostParsedJsonBytes (with `salvage`, that is left out and counted).
  core::Result<std::optional<RecordedEntry>> next();
  /// What could not be read, and what could not be checked: a sentence each, empty = nothing. Complete at the end.
  std::string loss_text() const;
  std::string unchecked_text() const { return reader_->unchecked().text(); }
  std::optional<std::uint64_t> message_count() const { return reader_->message_count(); }

 private:
  RecordingReader(std::unique_ptr<interfaces::McapReader> reader, bool salvage)
      : reader_(std::move(reader)), salvage_(salvage) {}
  MessageIndex index_of(std::uint32_t sequence);

  std::unique_ptr<interfaces::McapReader> reader_;
  bool salvage_ = false;
  RecordingInfo info_;
  bool has_info_ = false;
  bool info_is_damaged_ = false;
  bool is_numbered_ = false;         // sequences are the lower bits of the messages' numbers
  std::uint64_t too_long_json_ = 0;  // left out
  MessageIndex next_index_ = 0;
};

}  // namespace prescene::service
