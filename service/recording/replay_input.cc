// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/recording/replay_input.h"

#include <nlohmann/json.hpp>

#include "prescene/service/load_scene.h"
#include "prescene/service/outside_json.h"
#include "prescene/service/tracking/camera_presets.h"

namespace prescene::service {

core::Result<ReplayInput> ReplayInput::open(const ReplayInputOptions& options, const core::LogSink& log) {
  ReplayInput input;
  input.path_ = options.path;
  std::unique_ptr<RecordingReader> reader;
  if (!interfaces::is_bag(options.path)) {
    interfaces::FrameFolderOptions folder_options;
    folder_options.metres_per_unit = options.metres_per_unit;
    folder_options.frames_per_second = options.frames_per_second;
    folder_options.first_stamp_ns = 1'000'000'000;
    PRESCENE_TRY(input.folder_, interfaces::FrameFolder::open(options.path, folder_options));
    if (options.scene_file.empty()) input.scene_ = unknown_scene(options.path, input.folder_->frames().front().X_WC);
  } else {
    PRESCENE_TRY(reader, RecordingReader::open(options.path, options.read));
    input.info_ = reader->info();
    input.read_ = options.read;
    // Once is enough, and chunks are checked whenever they are read; what is salvaged has its loss reported at the end.
    input.read_.check_data = options.read.salvage || options.read.all_parts;
    if (!options.read.all_parts)
      for (const std::filesystem::path& next : parts_after(options.path, input.info_.part, 1)) input.goes_on_in_ = next;
  }
  if (input.scene_) return input;
  if (!options.scene_file.empty()) {
    PRESCENE_TRY(input.scene_, load_scene(options.scene_file, log, options.symmetries));
    PRESCENE_TRY(input.scene_text_, read_scene_text(options.scene_file));
    PRESCENE_TRY(input.robot_, load_robot(input.scene_text_, options.scene_file));
  } else if (!input.info_.scene_text.empty()) {
    const auto attached = [&reader](const std::string& name) { return reader->read_attached(name); };
    PRESCENE_TRY(
        input.scene_,
        reader->has_attached_scene()
            ? load_carried_scene(input.info_.scene_text, input.info_.scene_file, attached, log, options.symmetries)
            : load_scene_text(input.info_.scene_text, input.info_.scene_file, log, nullptr, options.symmetries));
    PRESCENE_TRY(input.robot_, reader->has_attached_scene()
                                   ? load_carried_robot(input.info_.scene_text, input.info_.scene_file, attached)
                                   : load_robot(input.info_.scene_text, input.info_.scene_file));
    input.scene_text_ = input.info_.scene_text;
  } else {
    return core::invalid_input(options.path.string() + " names no scene: give one with --scene FILE");
  }
  return input;
}

core::Result<TrackerSettings> ReplayInput::recorded_settings() const {
  if (info_.settings.empty()) return TrackerSettings{};
  auto recorded = with_recorded({}, parse_or_discard(info_.settings, kMostParsedJsonBytes));
  if (!recorded) return recorded.status().at(path_.string() + ": recorded settings");
  return recorded;
}

core::Result<ReplaySummary> ReplayInput::replay(Tracker& tracker, const core::Cancellation& cancellation,
                                                const core::ProgressSink& progress, const StepSink& on_step,
                                                const JsonSink& on_json) const {
  if (folder_) return replay_folder(*folder_, tracker, cancellation, progress, on_step);
  return replay_recording(path_, read_, tracker, cancellation, progress, on_step, on_json);
}

core::Status check_steps(const ReplaySummary& summary, const InputTopics& topics) {
  if (summary.steps > 0) return core::ok_status();
  if (!summary.last_skip.empty()) return core::invalid_input("no frame could be used: " + summary.last_skip);
  if (!summary.first_refusal.empty()) return core::invalid_input("no frame could be used: " + summary.first_refusal);
  if (!summary.loss.empty() && summary.image_topics.empty())
    return core::invalid_input("no depth image on " + topics.depth + ", and no other image that can be read (" +
                               summary.loss +
                               "): record the camera's topics (prescene doctor finds them), as messages of ROS 2");
  if (summary.image_topics.empty())
    return core::invalid_input("no depth image on " + topics.depth +
                               ", and no other image in the recording: record the "
                               "camera's topics (prescene doctor finds them)");
  return core::invalid_input(nothing_came_text(topics, summary.image_topics, "in the recording"));
}

}  // namespace prescene::service
