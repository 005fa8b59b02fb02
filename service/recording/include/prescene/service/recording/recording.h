// SPDX-License-Identifier: Apache-2.0
// Recordings: MCAP files with the robot's messages as they came, and what Prescene did with them: JSON in
// std_msgs/String under /prescene/, and poses, detections, markers and transforms of the objects for other programs.
// All is CDR, so that any ROS 2 and Foxglove play it. The scene file and what it names are attached.
#pragma once

#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "prescene/interfaces/bags/bag_reader.h"
#include "prescene/interfaces/bags/other_encodings.h"
#include "prescene/interfaces/dds/dds_node.h"
#include "prescene/interfaces/mcap/mcap_writer.h"
#include "prescene/service/load_scene.h"
#include "prescene/service/tracking/step_record.h"
#include "prescene/service/tracking/topics.h"

namespace prescene::service {

/// Which file it is of a recording that goes on in file after file (RollingRecording).
struct RecordingPart {
  std::string series;              ///< The same in all of them; "" = one file is all.
  std::uint64_t number = 0;        ///< 0 = the first; ascends.
  MessageIndex first_message = 0;  ///< The number of the first message of the robot that is new in it.
  core::TimeNs began_ns = 0;       ///< When it was begun, by the clock of its log times.
  bool after_gap = false;          ///< Something was not recorded between it and the one before.
  /// The file name under which it was asked to keep only so much; "" = it stays (PartLimits::keep_bytes).
  std::string bounded_as = "";
  /// With that, the name of the first file of its run: a file that is not called as part_path() says was renamed or
  /// copied since, and is nobody's to remove.
  std::string first_file = "";
};

/// What a recording says about itself, in its metadata record "prescene", with a checksum: in a recording that was cut
/// there is no other.
struct RecordingInfo {
  std::string scene_file;  ///< Where the scene came from, as given; "" = not known.
  std::string scene_text;  ///< Its YAML.
  std::uint64_t seed = 0;
  std::string settings;  ///< JSON of the settings that were used; "" = none.
  /// To be attached, with the scene's text: all that the scene names; nothing: a replay looks for them on the disk.
  /// RecordingReader leaves it empty: its read_attached() gives single files.
  std::optional<FilesOfScene> files = std::nullopt;
  RecordingPart part = {};
  /// The topic of the static transforms. Players of ROS offer these to readers that come later, too. RecordingReader
  /// does not fill it.
  std::string tf_static = InputTopics{}.tf_static;
};

/// Where to record a robot: `path`, or where that is a recording already (a file, or one of its parts), "run-2.mcap",
/// "run-3.mcap", ... beside it. What a robot saw can't be seen again, so nothing live is written over it.
std::filesystem::path unused_recording_path(const std::filesystem::path& path);

/// The file of a recording's part: "run.mcap", "run_0001.mcap", ...
std::filesystem::path part_path(const std::filesystem::path& first, std::uint64_t number);
/// What a file says of itself; its series is "" where that is nothing. Errors of McapReader::open.
core::Result<RecordingPart> part_of(const std::filesystem::path& file);
/// A file beside a recording that is called as its parts are and does not say that it belongs to it.
struct PassedOver {
  std::filesystem::path file;
  std::size_t after = 0;     ///< So many of the files of parts_after() come before it.
  bool is_readable = false;  ///< Else nothing of it can be read.
};
/// The files that go on after this one of a recording, in their order: those beside it whose names go on and that say
/// that they belong to it, at most so many. Empty for a recording that is one file, and for what can't be read.
/// `passed_over`, if given, gets the others that are called so.
std::vector<std::filesystem::path> parts_after(const std::filesystem::path& path, const RecordingPart& part,
                                               std::size_t most = std::numeric_limits<std::size_t>::max(),
                                               std::vector<PassedOver>* passed_over = nullptr);

/// Whether a channel holds JSON of ours, in std_msgs/String: its metadata says so.
bool holds_own_json(const interfaces::McapChannel& channel);
/// Whether it holds what we made for other programs (RecordingWriter::write_output).
bool is_own_output(const interfaces::McapChannel& channel);
/// Whether it holds what an earlier file of the recording does (RecordingWriter::write_again).
bool is_repeated(const interfaces::McapChannel& channel);

/// What of a recording may be lost: of what came, the last `kept_back_s` where the program is killed, and that,
/// `unsynced_s` and the time of two requests to the disk where the power fails.
struct RecordingSafety {
  double kept_back_s = 1.0;  ///< > 0
  double unsynced_s = 0.0;   ///< 0 = the power does not fail
};
/// Of what can't be made again: at most 0.2 s and, with a disk that takes up to a quarter of a second, 1 s are lost.
inline constexpr RecordingSafety kLiveRecording{0.2, 0.3};
/// After this time, s, it is reported that the disk does not keep up.
inline constexpr double kTooLongAtRisk = 1.0;

/// Writes one recording. Not thread-safe: owned by the thread that steps the belief.
class RecordingWriter {
 public:
  static core::Result<std::unique_ptr<RecordingWriter>> create(const std::filesystem::path& path,
                                                               const RecordingInfo& info,
                                                               const RecordingSafety& safety = {});
  /// The same in two steps, of which the first takes the time of writing the attached files. Nothing else may be
  /// written between them; `info.part` counts in the second only.
  static core::Result<std::unique_ptr<RecordingWriter>> make_ready(const std::filesystem::path& path,
                                                                   const RecordingInfo& info,
                                                                   const RecordingSafety& safety);
  core::Status begin(const RecordingInfo& info);

  /// Messages of the robot; numbered 0, 1, ... in the order of these calls. Their times are clamped to 1970 and
  /// kLatestRecordedNs: a sender's clock may say anything. What ends in an exception is not in the recording, and has
  /// no number.
  core::Result<MessageIndex> write(const interfaces::ReceivedMessage& message);
  /// A message that an earlier file holds under that number, repeated for who replays this one alone: to be called
  /// before any other is written, in ascending order. Readers that come from the file before pass over it.
  core::Status write_again(const interfaces::ReceivedMessage& message, MessageIndex index);
  /// The belief from which this file goes on (snapshot_text()).
  core::Status write_snapshot(const std::string& text);
  /// One JSON document of ours on a /prescene/ topic, in a std_msgs/String. kResourceExhausted, writing nothing, above
  /// most_json_bytes().
  core::Status write_json(const std::string& topic, const std::string& json, core::TimeNs time_ns);
  /// What we make of the belief for other programs. A replay makes it anew, so RecordingReader passes over it.
  core::Status write_output(const std::string& topic, const std::string& type, std::span<const std::uint8_t> cdr,
                            core::TimeNs stamp_ns, core::TimeNs time_ns);
  MessageIndex next_index() const { return next_index_; }
  interfaces::McapWriter::Size size() const { return writer_->size(); }
  core::Status flush() { return writer_->flush(); }
  /// To be called now and then with the time, by which messages are received: writes what was kept back for long
  /// enough.
  core::Status write_due(core::TimeNs now_ns) { return writer_->flush_by(now_ns); }
  /// How long ago the oldest of what was written and a power failure could take was written, s.
  double seconds_at_risk() const { return writer_->seconds_at_risk(); }
  core::Status close() { return writer_->close(); }

 private:
  explicit RecordingWriter(std::unique_ptr<interfaces::McapWriter> writer) : writer_(std::move(writer)) {}
  static core::Result<std::unique_ptr<RecordingWriter>> open(const std::filesystem::path& path,
                                                             const RecordingSafety& safety);
  core::Status attach(const RecordingInfo& info);
  core::Status write(const std::string& topic, const std::string& type, const std::string& kind, std::uint32_t sequence,
                     core::TimeNs log_ns, core::TimeNs publish_ns, std::span<const std::uint8_t> data);

  std::unique_ptr<interfaces::McapWriter> writer_;
  std::map<std::pair<std::string, std::string>, int> channels_;  // by topic and kind: /tf is the robot's and ours
  std::map<std::string, std::uint32_t> sequences_;               // of what is ours
  MessageIndex next_index_ = 0;
  std::string tf_static_;
};

/// Where one of several files begins.
struct PartStart {
  std::uint64_t number = 0;
  /// The file before was read, and nothing is missing in it or between the two; or something is, and this file holds no
  /// belief to go on from.
  bool goes_on = false;
  /// Else the belief from which to go on, for snapshot_from_text(); "" = the file has none, or is not read from its
  /// beginning.
  std::string snapshot;
};

/// One entry of a recording in its order.
struct RecordedEntry {
  interfaces::ReceivedMessage message;  ///< `cdr` holds the JSON text of entries that are JSON.
  bool is_json = false;                 ///< Ours, not the robot's.
  /// Of a robot message, as when it was written, whatever was lost before it. In a recording of another program,
  /// or one whose description is damaged: its place among those that are read.
  MessageIndex index = 0;
  /// Of the first entry that is new in a file after the first one of its recording. What comes before it of a file that
  /// does not go on is repeated.
  std::shared_ptr<const PartStart> part = nullptr;
};

struct RecordingReadOptions {
  bool salvage = false;    ///< As interfaces::BagReaderOptions.
  bool check_data = true;  ///< The same.
  /// Seconds since the recording's first message. Of what came before `from`, the transforms of the last 10 s, the
  /// static ones, the camera infos and what was set while the service ran are read, without which no later frame could
  /// be used, or not as it was; of what came after `to`, nothing.
  double from = 0.0;
  double to = std::numeric_limits<double>::infinity();
  bool all_parts = false;  ///< Of a recording of several files, also those after this one (parts_after()).
};

/// Reads our recordings, and those of ROS 2 (interfaces::BagReader).
class RecordingReader {
 public:
  /// Errors of BagReader::open; kDataLoss where the checksum of what it says about itself is wrong or missing (with
  /// `salvage`, that is left out).
  static core::Result<std::unique_ptr<RecordingReader>> open(const std::filesystem::path& path,
                                                             const RecordingReadOptions& options = {});

  /// From the recording's metadata; defaults where it has none (a recording made by other tools).
  const RecordingInfo& info() const { return info_; }
  /// In the order of log times; empty at the end. Errors of BagReader::next; kResourceExhausted for JSON that would be
  /// parsed and is longer than kMostParsedJsonBytes (with `salvage`, that is left out and counted). Messages that are
  /// not in CDR are left out and counted.
  core::Result<std::optional<RecordedEntry>> next();
  /// Whether the recording carries what its scene names. Older ones do not.
  bool has_attached_scene() const { return has_attached_scene_; }
  /// A file of FilesOfScene. Errors of McapReader::attachment.
  core::Result<std::vector<std::uint8_t>> read_attached(const std::string& name) const;
  /// Seconds from the recording's first message to this one, by their times of receiving; 0 before anything is read.
  double seconds_into(const RecordedEntry& entry) const {
    return first_ns_ ? core::seconds_of(entry.message.received_ns - *first_ns_) : 0.0;
  }
  /// What could not be read, and what could not be checked: a sentence each, empty = nothing. Complete at the end.
  std::string loss_text() const;
  std::string unchecked_text() const;
  /// Of the loss, what is in files of the recording that are not there or can't be read. Not what its last file was cut
  /// by, nor what was not recorded.
  const std::string& missing_text() const { return missing_; }
  /// The one that is read, or those of a bag, and with all_parts those after it.
  std::vector<std::filesystem::path> files() const;
  /// Nothing where it is not known: of several files before the last is reached.
  std::optional<std::uint64_t> message_count() const {
    return parts_.empty() ? reader_->message_count() : std::nullopt;
  }

 private:
  explicit RecordingReader(const RecordingReadOptions& options) : options_(options) {}
  core::Status open_file(const std::filesystem::path& path);
  /// False at the end.
  core::Result<bool> open_next_part();
  /// To what is lost: so many messages before the file that is read.
  void miss_before(std::uint64_t messages);
  /// Whether a repeated message is read.
  bool is_needed_again(const interfaces::McapChannel& channel, core::TimeNs log_ns) const;
  void mark_start(RecordedEntry& entry);
  MessageIndex index_of(std::uint32_t sequence);
  /// Whether a message of the robot is read although it came before `from`.
  bool is_needed_later(const interfaces::McapChannel& channel, double before) const;
  core::Result<std::optional<RecordedEntry>> own_json(const interfaces::McapChannel& channel,
                                                      interfaces::McapMessage message);

  std::unique_ptr<interfaces::BagReader> reader_;
  RecordingReadOptions options_;
  std::vector<std::filesystem::path> parts_;  // still to come
  std::filesystem::path path_;
  RecordingPart part_;                 // of the file that is read
  std::shared_ptr<PartStart> starts_;  // of the next entry that is new
  std::string lost_, unchecked_;       // of the files before
  std::string missing_;
  bool misses_some_ = false;  // since the last belief that was read, or the beginning
  std::vector<PassedOver> passed_over_;
  std::size_t opened_parts_ = 0;
  std::optional<core::TimeNs> first_ns_;  // when the first message came
  double last_at_ = 0.0;                  // s after it, of the latest message
  RecordingInfo info_;
  bool has_info_ = false;
  bool info_is_damaged_ = false;
  bool has_attached_scene_ = false;
  std::string tf_static_;            // the topic of the static transforms, if the recording says it
  bool is_numbered_ = false;         // sequences are the lower bits of the messages' numbers
  std::uint64_t too_long_json_ = 0;  // left out
  std::uint64_t damaged_json_ = 0;   // the same
  interfaces::OtherEncodings other_encodings_;
  MessageIndex next_index_ = 0;
};

}  // namespace prescene::service
