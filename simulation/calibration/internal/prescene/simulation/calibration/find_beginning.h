// SPDX-License-Identifier: Apache-2.0
// How a recording begins, which the recording itself does not say.
#pragma once

#include <string>
#include <vector>

#include "prescene/simulation/calibration/motion_calibration.h"

namespace prescene::simulation {

/// Least frames of a flight before the first contact.
inline constexpr std::size_t kLeastBeginning = 5;

/// Where a support and what lies on it may differ between a recording and its scene: m at least, and the share of the
/// object's size.
inline constexpr double kLeastMismatch = 0.002;
inline constexpr double kMismatchShare = 0.05;
/// m: by that, and by six times the noise of a coordinate, m.
double mismatch_of(const belief::Scene& scene, double position_noise);

/// What does not fall and is at a support begins sliding. What falls, and by the simulation of its first frames with
/// the model's means touches nothing for more than kLeastBeginning frames, begins in flight, which ends one frame
/// before the first contact (trackers smooth across it). Whether it falls, and how near it is, are decided against the
/// frames' `position_noise` of a coordinate, m (see position_noise_of()).
///
/// Fails with kInvalidInput, naming the recording, for what begins between the two, for what is held up by nothing or
/// stays inside a support (with the gap or the overlap), for what does not move, for fewer than kLeastBeginning + 2
/// frames, times that do not ascend, and poses that are not finite.
core::Result<RecordedMotion> find_beginning(std::string name, std::vector<TimedPose> frames, const belief::Scene& scene,
                                            const Simulator& simulator, core::ThreadPool& pool,
                                            double position_noise = 0.0);

}  // namespace prescene::simulation
