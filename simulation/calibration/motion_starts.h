// SPDX-License-Identifier: Apache-2.0
// Starts of simulations from the first frames of a recording, drawn about what these frames show.
#pragma once

#include <span>

#include "prescene/belief/world_state.h"
#include "prescene/simulation/calibration/ballistic_fit.h"
#include "prescene/simulation/calibration/motion_forecast.h"

namespace prescene::simulation {

/// A start and what its errors are made of, for noise one.
struct MotionStart {
  BallisticState state;
  geometry::Matrix3d place, turn, velocity, spin;
};
/// Fails as fit_sliding() and fit_ballistic() do.
core::Result<MotionStart> fit_motion_start(std::span<const TimedPose> frames, bool slides,
                                           const geometry::Vector3d& center_of_mass,
                                           const geometry::Vector3d& gravity_W);

/// Of a start: position, rotation, velocity, spin, friction.
inline constexpr int kStartDimensions = 13;
/// `uniforms`: kStartDimensions in (0, 1). `physical` has its frictions scattered.
belief::ObjectState drawn_start(const MotionStart& start, const ThrowScatter& scatter,
                                const belief::PhysicalParameters& physical, std::span<const double> uniforms);

}  // namespace prescene::simulation
