// SPDX-License-Identifier: Apache-2.0
// Whether the first frames of a recording fall, and how fast: the frames alone, without a simulator.
#pragma once

#include <span>

#include "prescene/simulation/calibration/ballistic_fit.h"

namespace prescene::simulation {

/// Acceleration of the centre of mass along gravity, m/s^2: that of gravity in flight, none on a level support.
struct FreeFall {
  double acceleration = 0.0;
  double error = 0.0;  ///< One standard error, as the frames' noise makes it.
};

/// Frames that free fall is looked at in, at most, s.
inline constexpr double kFallWindow = 0.25;
inline constexpr std::size_t kLeastFallFrames = 5;

/// The parabola through as many of the first frames as it takes for an error below an eighth of gravity, those of
/// kFallWindow at most and kLeastFallFrames at least, which are required. `position_noise` is of a coordinate, m;
/// `center_of_mass` p_OoOcm, m.
FreeFall measure_fall(std::span<const TimedPose> frames, const geometry::Vector3d& center_of_mass,
                      const geometry::Vector3d& gravity_W, double position_noise);
/// The same through all frames, at least three.
FreeFall measure_whole_fall(std::span<const TimedPose> frames, const geometry::Vector3d& center_of_mass,
                            const geometry::Vector3d& gravity_W, double position_noise);

/// Noise of a recorded coordinate, m: from the median third difference, which smooth motion hardly has, of frames that
/// do not repeat the one before. 0 where no recording has four frames.
double position_noise_of(std::span<const std::span<const TimedPose>> recordings);

}  // namespace prescene::simulation
