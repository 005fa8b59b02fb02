// SPDX-License-Identifier: Apache-2.0
// Replays a recording: the same messages, in the same order, at the times at which they came.
//
// A recording that holds step records is followed step by step, and each step's belief is compared with the recorded
// hash; one without (a robot's own recording, or a simulated one) is stepped whenever a frame is complete.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "prescene/core/progress.h"
#include "prescene/interfaces/images/frame_folder.h"
#include "prescene/service/recording/recording.h"
#include "prescene/service/tracking/tracker.h"

namespace prescene::service {

/// Called after each step with the tracker that made it.
using StepSink = std::function<core::Status(const TrackerStep& step, const Tracker& tracker)>;
/// Called with each JSON entry of the recording (truth, answers, ...).
using JsonSink = std::function<core::Status(const std::string& topic, const std::string& json, core::TimeNs time_ns)>;

struct ReplaySummary {
  std::uint64_t messages = 0;
  std::uint64_t refused = 0;  ///< Messages that made no sense; the first one's reason is in first_refusal.
  std::string first_refusal;
  std::vector<interfaces::DomainTopic> image_topics;  ///< Those that carried images, as if each had one writer.
  std::uint64_t steps = 0;
  std::uint64_t skipped = 0;  ///< Frames.
  std::string last_skip;      ///< Why the last frame was, if no step came after it.
  bool followed_step_records = false;
  /// Why the steps of a recording's later file, or of one after a gap, were not compared: it holds no belief to go on
  /// from, so that one began anew; "" = there is no such file, or it does.
  std::string began_anew;
  std::uint64_t compared = 0;  ///< Steps whose belief was compared with the recorded one.
  std::uint64_t different = 0;
  std::optional<std::uint64_t> first_different_step;
  bool cancelled = false;  ///< Stopped on request before the end.
  std::string loss;        ///< What of the file could not be read; empty = all was read.
  std::string missing;     ///< As RecordingReader::missing_text().
  std::string unchecked;   ///< What of it has no checksum; empty = all was checked.
  /// What was doubtful or second best in the steps (a distorting lens, ...), with the number of the steps that it was
  /// so in, in the order of the first ones. Of more than a hundred, the first.
  std::vector<std::pair<std::string, std::uint64_t>> degraded;
};

/// A stop on request ends it early, with what was done until then. Status of the sinks end the replay.
core::Result<ReplaySummary> replay_recording(const std::filesystem::path& path, const RecordingReadOptions& options,
                                             Tracker& tracker, const core::Cancellation& cancellation,
                                             const core::ProgressSink& progress, const StepSink& on_step,
                                             const JsonSink& on_json);

/// Plays a folder of images with camera poses as if a robot had sent them.
core::Result<ReplaySummary> replay_folder(const interfaces::FrameFolder& folder, Tracker& tracker,
                                          const core::Cancellation& cancellation, const core::ProgressSink& progress,
                                          const StepSink& on_step);

}  // namespace prescene::service
