// SPDX-License-Identifier: Apache-2.0
// Explains what a recording shows in a window of time (prescene/queries/explain.h): the recording is tracked up to the
// window's end, with what is reported of the robot in it.
//
//   PRESCENE_TRY(const ReplayInput input, ReplayInput::open({.path = "milk.mcap"}, log));
//   PRESCENE_TRY(auto explained, explain_recording(input, {.path = "milk.mcap", .from = 2.0, .to = 4.0}, settings,
//                                                  seed, backends, cancellation, progress));
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "prescene/queries/explain.h"
#include "prescene/service/recording/replay_input.h"

namespace prescene::service {

struct ExplainOptions {
  std::filesystem::path path;  ///< Of the recording, as in `input`; a folder of images has no actions.
  double from = 0.0;           ///< s since the first frame's stamp; the belief there is that of the last frame before.
  double to = 0.0;             ///< The same; the last frame that is looked at is not after it.
  RecordingReadOptions read;
  queries::ExplainQuery query;  ///< Its weights are those of the scene's `events`, whatever is given.
  /// s, wall time after which no search goes on, without the replay; empty = no limit. The answer then depends on the
  /// machine's speed.
  std::optional<double> max_seconds;
};

struct Explained {
  queries::ExplainAnswer answer;
  queries::ExplainWindow window;     ///< That it is about.
  double from = 0.0;                 ///< s since the first frame: of the frame that the window begins after, and ...
  double to = 0.0;                   ///< ... of its last.
  std::uint64_t step = 0;            ///< Of the belief after that.
  std::vector<std::string> remarks;  ///< Of the replay.
  double seconds = 0.0;              ///< Wall time of the explanation, without the replay; ...
  double cpu_seconds = 0.0;          ///< ... CPU time of the process in it.
};

/// kInvalidInput where the window is empty or outside of the recording; errors of the replay and of queries::explain.
core::Result<Explained> explain_recording(const ReplayInput& input, const ExplainOptions& options,
                                          const TrackerSettings& settings, std::uint64_t seed, Backends& backends,
                                          const core::Cancellation& cancellation, const core::ProgressSink& progress);

/// What is kept of a tracked recording for windows in it; for who drives the tracker himself.
class WindowKeeper {
 public:
  /// s since the first frame.
  WindowKeeper(double from, double to) : from_(from), to_(to) {}
  /// After each step; false once the window is over, and no step is needed any more.
  bool add(const belief::Observation& observation, std::shared_ptr<const belief::Belief> belief);
  core::TimeNs first_ns() const { return first_ns_; }
  core::TimeNs last_ns() const { return last_ns_; }
  /// The window, without actions.
  queries::ExplainWindow& window() { return window_; }

 private:
  double from_, to_;
  bool any_ = false;
  core::TimeNs first_ns_ = 0, last_ns_ = 0;
  queries::ExplainWindow window_;
};

/// Times are s since the recording's first frame.
nlohmann::ordered_json to_json(const Explained& explained);

}  // namespace prescene::service
