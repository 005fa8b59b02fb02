// SPDX-License-Identifier: Apache-2.0
// How a recording begins, which the recording itself does not say.
#pragma once

#include <string>
#include <vector>

#include "prescene/simulation/calibration/motion_calibration.h"

namespace prescene::simulation {

/// Least frames of a flight before the first contact.
inline constexpr std::size_t kLeastBeginning = 5;

/// Simulates the scene's object from the first frames, with the model's means. What touches nothing for at least
/// kLeastBeginning frames begins in flight, which ends one frame before the first contact (trackers smooth across it);
/// what touches within two frames, sliding. Fails with kInvalidInput, naming the recording, for what begins between the
/// two, for fewer than kLeastBeginning + 2 frames, times that do not ascend, and poses that are not finite.
core::Result<RecordedMotion> find_beginning(std::string name, std::vector<TimedPose> frames, const belief::Scene& scene,
                                            const Simulator& simulator, core::ThreadPool& pool);

}  // namespace prescene::simulation
