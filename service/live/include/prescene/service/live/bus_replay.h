// SPDX-License-Identifier: Apache-2.0
// Plays a recording onto the bus as the robot would, listens to what a running service makes of it, and asks it
// questions.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "prescene/belief/validation.h"
#include "prescene/core/log.h"
#include "prescene/core/progress.h"
#include "prescene/service/belief_summary.h"
#include "prescene/service/recording/recording.h"

namespace prescene::service {

/// A question to ask when the replay is `at` s into the recording, or at its end if that is earlier.
struct TimedQuestion {
  double at = 0.0;   ///< Finite, not negative.
  std::string json;  ///< An object.
};

inline constexpr belief::ScalarRange kReplaySpeeds{1e-3, 1e4, "give a factor between 0.001 and 10000"};

struct BusReplayOptions {
  interfaces::DdsOptions dds;
  double speed = 1.0;              ///< Times as fast as recorded, in kReplaySpeeds.
  double wait_for_service = 20.0;  ///< s to wait for a service to listen before the first message; 0 = don't.
  double wait_at_end = 2.0;        ///< s to wait for the last beliefs; answers get their seconds_to_wait().
  std::vector<TimedQuestion> questions;
  /// Plays it again from the start, with the same stamps, until it is cancelled; at once, not waiting for the last
  /// beliefs. A recording without a message of the robot is played once. `questions` has to be empty.
  bool loop = false;
  RecordingReadOptions read;
};

struct BusReplayResult {
  std::uint64_t messages = 0;          ///< Published.
  std::uint64_t rounds = 0;            ///< How often its playing was begun: 1 without `loop`.
  std::vector<BeliefSummary> beliefs;  ///< As published by the service in the last round, in order of arrival.
  struct Answered {
    double at = 0.0;  ///< s into the recording when it was asked
    std::string question;
    std::string answer;    ///< Empty if none came.
    double seconds = 0.0;  ///< From question to answer.
  };
  std::vector<Answered> answers;
  std::string loss;       ///< As ReplaySummary,
  std::string missing;    ///< like this one.
  std::string unchecked;  ///< The same.
};

/// `on_entry` sees each entry of the recording when its time has come, in the first round only. A request to cancel
/// ends it within 0.1 s, also in a pause of the recording; what was done is returned. Before anything is published it
/// fails with kCancelled then, with kInvalidInput for a speed out of range or a question that is none, and with
/// kUnavailable when no service listens in time.
core::Result<BusReplayResult> replay_over_bus(const std::filesystem::path& path, const BusReplayOptions& options,
                                              const core::Cancellation& cancellation,
                                              const core::ProgressSink& progress, const core::LogSink& log,
                                              const std::function<void(const RecordedEntry&)>& on_entry = {});

/// A sentence for a person if the service used less than half of the `frames` that were played, so that its poses and
/// answers are worse than they could be; else empty. `beliefs`: how many came back.
std::string unused_frames_text(std::size_t frames, std::size_t beliefs);

}  // namespace prescene::service
