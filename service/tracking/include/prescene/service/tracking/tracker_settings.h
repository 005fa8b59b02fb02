// SPDX-License-Identifier: Apache-2.0
// What the tracker may be told, and its form in recordings.
#pragma once

#include <nlohmann/json_fwd.hpp>
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
  filter::FilterSettings filter;
};

/// Whether the images are rectified: as the settings say, else as the name of the depth topic does.
bool is_rectified(const TrackerSettings& settings);
/// What speaks against it: one of the image topics is named as rectified, the other is not, and the settings don't say
/// which holds. "" if nothing does.
std::string rectified_doubt(const TrackerSettings& settings);

/// Topics, assembler and tf: all that decides which frames are seen from where. The filter's settings are those of the
/// program's version.
nlohmann::ordered_json to_json(const TrackerSettings& settings);
/// The settings with what `json` says; kInvalidInput naming the key for a value of another type, a camera pose that is
/// none, or a number that is not finite. Unknown keys are ignored: a later version may have written them.
core::Result<TrackerSettings> with_recorded(TrackerSettings settings, const nlohmann::ordered_json& json);

}  // namespace prescene::service
