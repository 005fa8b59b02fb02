// SPDX-License-Identifier: Apache-2.0
// How far the scene's object is from what could hold it up, as the simulator has their shapes.
#pragma once

#include <optional>
#include <span>

#include "prescene/simulation/calibration/ballistic_fit.h"
#include "prescene/simulation/simulator.h"

namespace prescene::simulation {

/// m, against gravity: moved down by so much the object touches a support; below 0: it takes this lift to free it of
/// one. About half a millimetre or 15 % fine. Nothing where it touches none within kFarthestClearance.
inline constexpr double kFarthestClearance = 2.0;
std::optional<double> clearance_of(const geometry::Pose& X_WO, const belief::Scene& scene, const Simulator& simulator,
                                   core::ThreadPool& pool);

/// Frames in which the object stays in a support even when it is lifted by `lift` m.
std::size_t frames_inside(std::span<const TimedPose> frames, double lift, const belief::Scene& scene,
                          const Simulator& simulator, core::ThreadPool& pool);

}  // namespace prescene::simulation
