// SPDX-License-Identifier: Apache-2.0
// A recording that goes on in file after file, for what runs for weeks: "run.mcap", "run_0001.mcap", "run_0002.mcap"...
//
//   PRESCENE_TRY(const auto recording, RollingRecording::create("run.mcap", info, {.part = {.seconds = 3600.0}}, log));
//   recording->write(message);                              // and so on, as RecordingWriter's
//   if (recording->is_change_due()) recording->change([snapshot] { return snapshot_text(snapshot, scene); });
//   recording->write_due(core::steady_now_ns());
//   PRESCENE_RETURN_IF_ERROR(recording->close());
//
// A new file begins after a time, at a size, and before the index of the old one grows too long to be read. Each is a
// recording of its own: it holds the scene, its files and the settings, repeats what of the robot's messages its first
// frames need (the transforms of the last 10 s, the static ones, camera infos, images that wait), and holds the belief
// from which it goes on. So each replays to the recorded bits, alone or with those before it, and together they hold
// each message once.
//
// A thread of its own makes the next file ready, closes the old one, and writes down the belief, while recording and
// tracking go on: nobody waits for the disk. Where writing fails, as the disk is full, the recording pauses, and goes
// on in a new file once there is room again.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "prescene/core/log.h"
#include "prescene/service/recording/recording.h"
#include "prescene/service/recording/repeated_messages.h"

namespace prescene::service {

class RecordingRoom;
struct RemovedFile;

/// When a new file begins; 0 = not by this. It always does before a reader's limits are reached
/// (interfaces::McapReader): at half of them.
struct PartLimits {
  double seconds = 0.0;
  /// Of what is new in the file: without the attached files, what is repeated, and the belief.
  std::uint64_t bytes = 0;
  /// The oldest files are removed when all take more than this: those of this recording, but for the newest two, and
  /// before them those of earlier ones that were made with such a bound under the same name (RollingOptions::asked).
  std::uint64_t keep_bytes = 0;
};

struct RollingOptions {
  PartLimits part = {};
  RecordingSafety safety = kLiveRecording;
  /// s between two tries to begin a new file after writing failed.
  double pause = 10.0;
  /// Bytes that have to be free on the disk for such a try.
  std::uint64_t room = std::uint64_t{64} << 20;
  /// The name that was asked for, where unused_recording_path() gave another; "" = it did not.
  std::filesystem::path asked = {};
  /// The file is in a new folder, which becomes a bag of rosbag2: create() makes it, and close() writes its
  /// metadata.yaml.
  bool as_bag = false;
};

/// How a recording is.
struct RollingState {
  std::filesystem::path file;       ///< That is written, or was last.
  std::uint64_t files = 1;          ///< That were begun.
  std::uint64_t removed = 0;        ///< Files that were removed (PartLimits::keep_bytes).
  std::uint64_t interruptions = 0;  ///< Times that writing failed.
  std::uint64_t tries = 0;          ///< To begin a new file after that.
  std::uint64_t lost_messages = 0;  ///< Of the robot, in the pauses.
  std::string failure;              ///< Why nothing is written now; "" = all is well.
  std::string first_failure;        ///< Why it was not for the first time; stays.
  std::string without_belief;       ///< Why the file holds no belief to go on from; "" = it does, or needs none.
  std::string not_removed;          ///< Why the last file that was to go could not be removed; "" = it could.
  /// Messages that the next file should have repeated and does not: there were too many (RepeatedMessages), or there
  /// was no memory for them. Frames at its beginning may lack them.
  std::uint64_t not_repeated = 0;
  std::uint64_t unfinished = 0;  ///< Jobs of the recording's thread that ended in an exception.
  std::string last_unfinished;   ///< Why the last of them did.
};

/// Not thread-safe: owned by the thread that steps the belief. Where a call throws (there is no memory), what was to be
/// written is not in the recording, which goes on, in a new file if need be. Its own thread throws nothing.
class RollingRecording {
 public:
  /// Begins the first file; errors of RecordingWriter::create. `info.part` is not looked at. kUnavailable where the
  /// folder of `as_bag` is there already or can't be made.
  static core::Result<std::unique_ptr<RollingRecording>> create(const std::filesystem::path& path, RecordingInfo info,
                                                                const RollingOptions& options = {},
                                                                core::LogSink log = {});
  /// Closes without reporting errors.
  ~RollingRecording();
  RollingRecording(const RollingRecording&) = delete;
  RollingRecording& operator=(const RollingRecording&) = delete;

  /// As RecordingWriter's, but that what can't be written is counted, and pauses the recording. Every message gets a
  /// number, written or not.
  MessageIndex write(const interfaces::ReceivedMessage& message);
  void write_json(const std::string& topic, const std::string& json, core::TimeNs time_ns);
  void write_output(const std::string& topic, const std::string& type, std::span<const std::uint8_t> cdr,
                    core::TimeNs stamp_ns, core::TimeNs time_ns);
  /// To be called now and then with the time by which messages are received.
  void write_due(core::TimeNs now_ns);
  /// Pauses it: something could not be recorded that a replay needs.
  void fail(const core::Status& why);

  /// Of the images, a file that begins from now on needs those from this number on.
  void need_images_from(MessageIndex index) { repeated_.need_images_from(index); }
  /// Whether a new file is ready to be begun: the next call should be change().
  bool is_change_due();
  /// Goes on in the new file, at a moment at which every message that was written has been taken in. `snapshot` gives
  /// the belief of now (snapshot_text()); it is called on the recording's own thread. Null: there is no belief.
  using Snapshot = std::function<core::Result<std::string>()>;
  void change(Snapshot snapshot);
  /// Has the next file begun as soon as it can be, whatever the limits say.
  void ask_for_change() { is_asked_ = true; }

  bool is_on() const { return writer_ != nullptr; }
  double seconds_at_risk() const { return writer_ ? writer_->seconds_at_risk() : 0.0; }
  const RollingState& state() const { return state_; }
  /// Ends the last file. The first failure since the start, if there was one.
  core::Status close();

 private:
  core::Status write_bag_metadata() const;
  struct Ready {
    std::unique_ptr<RecordingWriter> writer;
    std::filesystem::path path;
  };
  RollingRecording(std::filesystem::path first, RecordingInfo info, const RollingOptions& options, core::LogSink log);
  bool is_full(core::TimeNs now_ns) const;
  bool wants_file(core::TimeNs now_ns);
  void begin_making_ready(core::TimeNs now_ns);
  void take_results();
  void take(const core::Status& written);
  void remove_oldest();
  /// Hands over to the thread.
  void work(std::function<void()> job);
  void run();
  /// Closes it on the thread, or here where there is no memory to hand it over.
  void close_later(std::unique_ptr<RecordingWriter> writer, bool reports);
  /// Counts that nothing is written from now on.
  void interrupt(const core::Status& why);
  /// Of the file of that number, on the thread.
  core::Result<Ready> made_ready(std::uint64_t number);
  void begin_file(Ready ready);
  /// Of a file that could not be begun: removes it.
  void put_aside(Ready ready, const core::Status& why);
  void note_first_failure(const core::Status& why);
  void take_snapshot();
  void note(const interfaces::ReceivedMessage& message, MessageIndex index);

  std::filesystem::path first_;
  RecordingInfo info_;
  RollingOptions options_;
  core::LogSink log_;
  std::unique_ptr<RecordingWriter> writer_;  // null while nothing can be written
  RepeatedMessages repeated_;
  RollingState state_;
  core::Status failed_;  // the first failure
  MessageIndex next_index_ = 0;
  core::TimeNs now_ns_ = 0, began_ns_ = 0;
  std::optional<core::TimeNs> tried_ns_;
  std::uint64_t own_bytes_ = 0;    // of the file: attached, repeated, and the belief
  std::uint64_t number_ = 0;       // of the file that was begun last
  std::uint64_t next_number_ = 1;  // that no file was made with
  bool is_making_ready_ = false, is_asked_ = false, has_gap_ = false;
  std::deque<std::filesystem::path> kept_;  // this recording's files
  std::unique_ptr<RecordingRoom> room_;     // used on the thread; null where all is kept
  std::uint64_t not_noted_ = 0;             // messages that there was no memory to repeat
  bool told_not_repeated_ = false;          // of this file

  std::mutex mutex_;  // guards all below
  std::condition_variable changed_;
  std::deque<std::function<void()>> jobs_;
  std::optional<core::Result<Ready>> ready_;
  std::optional<std::pair<std::uint64_t, core::Result<std::string>>> snapshot_;  // of the file of that number
  std::vector<core::Status> closed_;                                             // failures
  std::uint64_t unfinished_ = 0;
  core::Status last_unfinished_;
  std::vector<RemovedFile> removed_;
  bool ends_ = false;
  std::thread thread_;  // last: it uses all above
};

}  // namespace prescene::service
