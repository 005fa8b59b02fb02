// SPDX-License-Identifier: Apache-2.0
// What can be replayed: a recording, or a folder of images with camera poses.
//
//   PRESCENE_TRY(ReplayInput input, ReplayInput::open({.path = "milk.mcap"}, log));
//   PRESCENE_TRY(auto tracker, Tracker::create(input.scene(), settings, input.seed_or(1), backends));
//   PRESCENE_TRY(auto summary, input.replay(*tracker, cancellation, progress, on_step, on_json));
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "prescene/core/log.h"
#include "prescene/interfaces/images/frame_folder.h"
#include "prescene/service/load_scene.h"
#include "prescene/service/recording/recording.h"
#include "prescene/service/recording/replay.h"

namespace prescene::service {

struct ReplayInputOptions {
  std::filesystem::path path;
  /// Empty: the one that the recording holds; a folder without one is searched for its support.
  std::filesystem::path scene_file;
  double metres_per_unit = 0.001;   ///< Of a folder's depth images.
  double frames_per_second = 30.0;  ///< Of a folder without stamps.
  RecordingReadOptions read = {};   ///< Of a recording.
  Symmetries symmetries = Symmetries::kAsWritten;
};

class ReplayInput {
 public:
  /// Errors of FrameFolder::open, RecordingReader::open and load_scene; kInvalidInput where no scene is named.
  static core::Result<ReplayInput> open(const ReplayInputOptions& options, const core::LogSink& log);

  const std::shared_ptr<const belief::Scene>& scene() const { return scene_; }
  /// How the robot that the scene describes moves, for AssemblerSettings::robot; null where it describes none.
  const std::shared_ptr<const interfaces::RobotKinematics>& robot() const { return robot_; }
  /// The text of the scene file; "" of a folder without one.
  const std::string& scene_text() const { return scene_text_; }
  /// What it was made with, but for the topics, camera and filter of `settings` where it says nothing. kInvalidInput
  /// for recorded settings that make no sense.
  core::Result<TrackerSettings> recorded_settings() const;
  /// How the recording is read, and whether it begins in a later file of several.
  const RecordingReadOptions& read_options() const { return read_; }
  bool begins_later() const { return info_.part.number > 0; }
  /// The next file of the recording, which is not read; empty where there is none.
  const std::filesystem::path& goes_on_in() const { return goes_on_in_; }
  bool has_settings() const { return !info_.settings.empty(); }
  /// The seed that the recording was made with: it repeats its bits.
  std::uint64_t seed_or(std::uint64_t seed) const { return info_.seed == 0 ? seed : info_.seed; }

  core::Result<ReplaySummary> replay(Tracker& tracker, const core::Cancellation& cancellation,
                                     const core::ProgressSink& progress, const StepSink& on_step,
                                     const JsonSink& on_json) const;

 private:
  std::filesystem::path path_;
  RecordingReadOptions read_;
  std::filesystem::path goes_on_in_;
  std::optional<interfaces::FrameFolder> folder_;  // else a recording
  RecordingInfo info_;
  std::string scene_text_;
  std::shared_ptr<const belief::Scene> scene_;
  std::shared_ptr<const interfaces::RobotKinematics> robot_;
};

/// kInvalidInput with the reason if no frame was of use.
core::Status check_steps(const ReplaySummary& summary, const InputTopics& topics);

}  // namespace prescene::service
