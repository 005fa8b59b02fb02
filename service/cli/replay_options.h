// SPDX-License-Identifier: Apache-2.0
// What `replay` was asked for, and its two ways to do it: in this process, and over the bus.
#pragma once

#include <string>
#include <vector>

#include "prescene/core/status.h"
#include "prescene/service/backends.h"
#include "prescene/service/live/bus_replay.h"
#include "prescene/service/recording/replay_input.h"
#include "prescene/service/tracking/tracker_settings.h"
#include "relations_options.h"
#include "verb.h"

namespace prescene::service {

struct ReplayOptions {
  std::string input;
  BackendSettings backends;
  std::string scene;
  std::string report;
  std::string proposals;
  std::string learned;
  bool over_dds = false;
  BusReplayOptions bus;
  RecordingReadOptions read;
  std::vector<std::string> questions;
  std::string timeline_file;
  TimelineOptions timeline;
  double depth_scale = 0.001;
  double frame_rate = 30.0;
  TrackerSettings tracker;
  const CLI::App* verb = nullptr;
};

/// Tracks what is replayed in this process and compares it with what the recording holds.
core::Status replay_here(const ReplayOptions& options, VerbContext& context);
/// Publishes the messages and listens to a running `serve`.
core::Status replay_over_dds(ReplayOptions& options, VerbContext& context);

// Of both.
ReplayInputOptions replay_input_of(const ReplayOptions& options);
/// What the recording was made with, but for what the command line says otherwise.
core::Result<TrackerSettings> replay_settings_of(const ReplayOptions& options, const ReplayInput& input);
/// Says what of the recording could not be checked, if anything.
void warn_of_unchecked(const ReplayOptions& options, const std::string& unchecked, VerbContext& context);
/// kDataLoss where files of the recording are not there; --salvage takes what is.
core::Status check_files_are_there(const ReplayOptions& options, const std::string& missing);

}  // namespace prescene::service
