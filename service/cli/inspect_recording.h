// SPDX-License-Identifier: Apache-2.0
// A recording: what it holds; and one frame of it and what is believed of it.
#pragma once

#include <string>

#include "prescene/core/status.h"
#include "prescene/service/recording/replay_input.h"
#include "verb.h"

namespace prescene::service {

struct RecordingInspection {
  ReplayInputOptions input;
  int frame = 0;               ///< Counted from 0 over the frames that belief steps used.
  std::string overlay;         ///< PNG to write; empty = none.
  std::string likelihood_map;  ///< The same.
  TrackerSettings tracker;     ///< Topics and camera, where the verb's options name them or the recording does not.
  const CLI::App* verb = nullptr;
};

/// Replays up to the frame, prints what is believed there and writes the pictures. kInvalidInput where the recording is
/// shorter.
core::Status inspect_recording(const RecordingInspection& options, VerbContext& context);

/// Prints what the recording holds: topics, rates, gaps, cameras, problems.
core::Status describe_recording(const std::string& path, VerbContext& context);

}  // namespace prescene::service
