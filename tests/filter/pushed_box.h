// SPDX-License-Identifier: Apache-2.0
// A box on a table that a known pusher pushes, and what a tracker reports of it: poses with noise of the covariance
// that is stated. Its motion is simulated with a friction that the belief does not know. Or a hand drops the box onto
// the edge of a block, from where it tumbles to the table.
#pragma once

#include <memory>
#include <vector>

#include "prescene/belief/belief.h"
#include "prescene/core/parallel.h"
#include "prescene/simulation/simulator.h"

namespace prescene::filter_tests {

struct Push {
  double friction = 0.4;        ///< The true one.
  double mass = 0.4;            ///< kg
  double speed = 0.5;           ///< Of the pusher, m/s; 0 = it does not come.
  double aside = 0.0;           ///< m, its offset from the box's middle.
  double slope = 0.0;           ///< Of the table, rad about the y axis.
  int frames = 60;              ///< At 30 Hz; the pusher comes after a third of them.
  bool held = false;            ///< By a hand above it, in every frame.
  double shift_noise = 0.0015;  ///< m, standard deviation of what is tracked.
  double turn_noise = 0.008;    ///< rad
};

/// The scene as a user describes it: friction uniform in (0.1, 0.9), mass 0.4 +- 0.05 kg.
std::shared_ptr<const belief::Scene> push_scene(const Push& push);
/// Bullet's or the lockstep stepper, whichever can do it.
simulation::SimulatorFactory push_simulators();
struct Drop {
  double friction = 0.4;     ///< The true one.
  double restitution = 0.2;  ///< The true one.
  double height = 0.1;       ///< m, of the box above the block's top.
  double over = 0.01;        ///< m by which the box's middle is outside the block's edge.
  double tilt = 0.1;         ///< rad about the edge.
  int frames = 50;           ///< At 15 Hz; the hand lets go after a fifth of them.
};

/// The scene as a user describes it: friction 0.4 +- 0.1, restitution 0.2 +- 0.1. A hand holds the box.
std::shared_ptr<const belief::Scene> drop_scene(const Drop& drop);
/// As tracked_push. The hand gives the box a small velocity (0.05 m/s and 0.3 rad/s in each direction), which the
/// tracker knows as well as that.
std::vector<belief::Belief> tracked_drop(const Drop& drop, std::uint64_t seed, core::ThreadPool& threads);

/// One belief a frame, as a tracker would have it that learned nothing.
std::vector<belief::Belief> tracked_push(const Push& push, std::uint64_t seed, core::ThreadPool& threads);

}  // namespace prescene::filter_tests
