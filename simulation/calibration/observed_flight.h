// SPDX-License-Identifier: Apache-2.0
// The frames of one flight, made ready to fit a motion to them.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "prescene/core/status.h"
#include "prescene/geometry/pose.h"
#include "prescene/simulation/calibration/ballistic_fit.h"

namespace prescene::simulation {

/// Of a flight at its middle frame: centre of mass and its velocity, turn from the tracked orientation, spin (body
/// axes).
inline constexpr int kFlightMotion = 12;

struct FlightFrame {
  double time = 0.0;  // Since the middle frame, s.
  geometry::Pose X_WO;
  int steps = 1;  // From the frame before, or after for those before the middle.
  double position_weight = 0.0;
  double rotation_weight = 0.0;
};

struct ObservedFlight {
  std::vector<FlightFrame> frames;
  std::size_t middle = 0;
  std::array<double, kFlightMotion> motion{};
};

/// Fails with kInvalidInput, naming the flight by its number, for poses that are not finite, times that do not ascend,
/// and more than a quarter turn between frames.
core::Result<ObservedFlight> observed_flight(std::span<const TimedPose> poses, std::size_t number);

/// Where the fit of its motion starts: straight lines between the frames about the middle.
void guess_motion(const geometry::Vector3d& center_of_mass, ObservedFlight* flight);

}  // namespace prescene::simulation
