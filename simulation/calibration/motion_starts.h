// SPDX-License-Identifier: Apache-2.0
// Starts of simulations from the first frames of a recording, drawn about what these frames show.
#pragma once

#include <cstddef>
#include <span>

#include "prescene/belief/world_state.h"
#include "prescene/simulation/calibration/ballistic_fit.h"
#include "prescene/simulation/calibration/motion_forecast.h"
#include "prescene/simulation/simulator.h"

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

/// s: what the errors of a start lift off its support by a millimetre, or tilt by as much, lies on it again by then.
inline constexpr double kLanding = 0.025;
/// What slides lies on its support, and only the errors of its start say otherwise: takes the starts with these numbers
/// on by `seconds` in which nothing bounces. Of scenes with one object.
void land(const Simulator& simulator, std::span<const std::size_t> sliding, double seconds,
          const core::RandomStream& stream, core::ThreadPool& pool, std::span<belief::WorldState> starts,
          const core::Cancellation* cancellation);

}  // namespace prescene::simulation
