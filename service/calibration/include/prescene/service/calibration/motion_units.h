// SPDX-License-Identifier: Apache-2.0
// Recordings whose numbers cannot be metres and seconds, before anything is fitted to them.
#pragma once

#include <vector>

#include "prescene/core/status.h"
#include "prescene/service/calibration/motion_dataset.h"

namespace prescene::service {

/// Fails with kInvalidInput and the remedy where the typical recording begins faster, or gains speed faster, than
/// anything that is tossed or slid by hand under `gravity` (m/s^2), or has half a second or more between its frames.
core::Status check_units(const std::vector<MotionRecording>& recordings, double gravity);

/// Frames a second, of the typical recording; 0 for none of two frames.
double frame_rate(const std::vector<MotionRecording>& recordings);

}  // namespace prescene::service
