// SPDX-License-Identifier: Apache-2.0
// Records the robot's topics as they are, without tracking: for later replays.
#pragma once

#include <vector>

#include "prescene/core/log.h"
#include "prescene/core/progress.h"
#include "prescene/service/recording/rolling_recording.h"
#include "prescene/service/tracking/camera_frames.h"

namespace prescene::service {

/// Writes what comes on the topics of the cameras and on our control, query and answer topics until cancelled; closes
/// the recording and returns the number of messages. Fails, after going on to the end, where writing failed on the way.
core::Result<std::uint64_t> record_topics(const interfaces::DdsOptions& dds, const std::vector<CameraInput>& cameras,
                                          const core::Cancellation& cancellation, const core::LogSink& log,
                                          RollingRecording& recording);

}  // namespace prescene::service
