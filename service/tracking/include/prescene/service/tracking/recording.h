// SPDX-License-Identifier: Apache-2.0
// Recordings: MCAP files with the robot's messages as they came, and what Prescene did with them, as JSON under
// /prescene/.
#pragma once

#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "prescene/interfaces/dds/dds_node.h"
#include "prescene/interfaces/mcap/mcap_reader.h"
#include "prescene/interfaces/mcap/mcap_writer.h"
#include "prescene/service/tracking/frame_assembler.h"

namespace prescene::service {

/// What a recording says about itself, in its metadata record "prescene", with a checksum: in a recording that was cut
/// there is no other.
struct RecordingInfo {
  std::string scene_file;  ///< Where the scene came from, as given; "" = not known.
  std::string scene_text;  ///< Its YAML.
  std::uint64_t seed = 0;
  std::string settings;  ///< JSON of the settings that were used; "" = none.
};

/// What was done in one belief step: enough to repeat it. JSON form on kStepTopic.
struct StepRecord {
  std::uint64_t step = 0;
  /// Messages with a number up to this one had been taken in; the frame was chosen as if at `now_ns`.
  MessageIndex after = 0;
  core::TimeNs now_ns = 0;
  core::TimeNs stamp_ns = 0;  ///< Of the frame.
  MessageIndex depth = 0;
  std::optional<MessageIndex> color;
  MessageIndex camera_info = 0;
  MessageIndex tf_until = 0;
  std::vector<SkippedFrame> skipped;  ///< Since the step before.
  std::vector<std::string> degraded;  ///< What could not be done fully.
  std::string belief_hash;            ///< Of all bits of the belief after the step.
  double seconds = 0.0;               ///< Wall time it took; not replayed.
};
nlohmann::ordered_json to_json(const StepRecord& record);
/// kInvalidInput naming the key that is missing or is not what to_json() writes; lists and seconds may be missing.
core::Result<StepRecord> step_record_from_json(const std::string& text);

/// Times beyond it, in the year 2116, are written as this one and read as damage. The sum of two is in range.
inline constexpr core::TimeNs kLatestRecordedNs = std::numeric_limits<core::TimeNs>::max() / 2;

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
