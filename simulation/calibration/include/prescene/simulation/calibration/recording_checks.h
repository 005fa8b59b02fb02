// SPDX-License-Identifier: Apache-2.0
// What the frames of a recording say about the recording itself: when it comes to rest, whether it was touched after
// that, whether its stamps jump, and which recordings are twins of one another. Frames alone, without a simulator.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "prescene/simulation/calibration/ballistic_fit.h"

namespace prescene::simulation {

/// Frames in which an object lies still.
struct RecordedRest {
  std::size_t first = 0;
  std::size_t last = 0;
  /// Where it moves again after that, which nothing that rests does by itself: the frame, and by how far it ends up
  /// from where it lay, m and rad.
  std::optional<std::size_t> moves_again;
  double moved = 0.0;
  double turned = 0.0;
};

/// The first frames that stay where they are until the recording ends (for 0.03 s and five frames at least), or for
/// 0.15 s. Staying: within 1 mm and 0.02 rad, or six times the tracker's noises where these are larger, and without
/// drift. Nothing where the object never comes to rest. A frame at the end that is far off is no rest either.
std::optional<RecordedRest> find_rest(std::span<const TimedPose> frames, double position_noise,
                                      double rotation_noise = 0.0);

/// Noise of a recorded rotation about each axis, rad: from the median third difference, as position_noise_of().
double rotation_noise_of(std::span<const std::span<const TimedPose>> recordings);

/// The first frame whose step from the one before is more than eight times the median step.
std::optional<std::size_t> find_stamp_jump(std::span<const TimedPose> frames);

/// For each recording the place of the first one with the same motion, its own where there is none before: the same
/// up to a turn about the vertical and a horizontal shift (heights and tilts agree in all frames within 0.1 mm and
/// 2 mrad), though one may begin or end some frames later. Two throws never agree so well.
std::vector<std::size_t> find_twins(std::span<const std::span<const TimedPose>> recordings);

}  // namespace prescene::simulation
