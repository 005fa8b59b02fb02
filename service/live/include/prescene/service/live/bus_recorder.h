// SPDX-License-Identifier: Apache-2.0
// Records the robot's topics as they are, without a scene: for later replays.
#pragma once

#include "prescene/core/log.h"
#include "prescene/core/progress.h"
#include "prescene/service/recording/recording.h"
#include "prescene/service/tracking/topics.h"

namespace prescene::service {

/// Writes what comes on the topics and on our control, query and answer topics until cancelled; closes the recording
/// and returns the number of messages.
core::Result<std::uint64_t> record_topics(const interfaces::DdsOptions& dds, const InputTopics& topics,
                                          const core::Cancellation& cancellation, const core::LogSink& log,
                                          RecordingWriter& recording);

}  // namespace prescene::service
