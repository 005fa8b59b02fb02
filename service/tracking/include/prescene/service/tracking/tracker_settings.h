// SPDX-License-Identifier: Apache-2.0
// The tracker's settings, and their form in recordings.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "prescene/core/status.h"
#include "prescene/filter/particle_filter.h"
#include "prescene/service/tracking/frame_assembler.h"
#include "prescene/service/tracking/topics.h"

namespace prescene::service {

struct TrackerSettings {
  InputTopics topics;
  AssemblerSettings assembler;
  TfBufferSettings tf;
  /// What an earlier session learned of physical parameters: the text of a learned file, and its name in messages.
  /// Empty = nothing.
  std::string learned;
  std::string learned_file;
  /// Look for things that the scene does not name; empty = as the scene says.
  std::optional<bool> new_objects;
  filter::FilterSettings filter;
};

/// Whether the images are rectified: as the settings say, else as the name of the depth topic does.
bool is_rectified(const TrackerSettings& settings);
/// What speaks against it: one of the image topics is named as rectified, the other is not, and the settings don't say
/// which holds. "" if nothing does.
std::string rectified_doubt(const InputTopics& topics, const AssemblerSettings& assembler);
std::string rectified_doubt(const TrackerSettings& settings);

/// All but the filter's settings, which are those of the program's version.
nlohmann::ordered_json to_json(const TrackerSettings& settings);
/// The settings with what `json` says; kInvalidInput naming the key for a value of another type, a camera pose that is
/// none, or a number that is not finite. Unknown keys are ignored: a later version may have written them.
core::Result<TrackerSettings> with_recorded(TrackerSettings settings, const nlohmann::ordered_json& json);

/// Those that may change while it tracks: max_wait_s and max_stamp_difference_s of the assembler, and new_objects, as
/// JSON for kSettingsTopic. All of them, so that the newest such text holds alone.
std::string running_settings_text(const TrackerSettings& settings);
/// The settings with what such a text says of these; errors of with_recorded.
core::Result<TrackerSettings> with_running(const TrackerSettings& settings, const std::string& text);

}  // namespace prescene::service
