// SPDX-License-Identifier: Apache-2.0
// Learning physical parameters: when an object lay still and then was moved, or was let go, or lies still on what is
// tilted, that piece of its motion is simulated under each draw of its friction, mass, restitution and centre of mass,
// and the draws are weighted by how well they explain what was seen.
//
//   LearnReport report = learn_physics(belief, options, simulators, pool);   // once a frame, after weight
//
// Frames in which nothing happens change nothing. Posterior = prior times likelihood; the simulator's prediction of a
// whole piece of motion stands in for the likelihood of its frames, through the tracked poses and their covariances.
// What impacts throw about is hardly predictable: how much a run's likeness to what was seen says is found out with the
// runs themselves, one of which takes the part of what was seen in turn (approximate Bayesian computation with a kernel
// chosen by cross-validation [Sisson et al. 2018]).
#pragma once

#include <string>

#include "prescene/belief/belief.h"
#include "prescene/simulation/simulator.h"

namespace prescene::filter {

struct LearnPhysicsOptions {
  /// switch. Learn at all. Range true or false. Chosen.
  bool enabled = true;
  /// frames. An object that is tracked for so many without moving lies still. Range 2 to 100. Chosen.
  int rest_frames = 10;
  /// m. It moves when it is further from where it lay, ... Range 0.001 to 0.1. Chosen.
  double start_shift = 0.008;
  /// rad. ... or turned further, each at least three of its standard deviations. Range 0.01 to 1. Chosen.
  double start_turn = 0.09;
  /// count. Runs of a draw, each from a start of its own that is drawn from the start's covariance. Range 1 to 64.
  /// Chosen.
  int variants = 4;
  /// count. Simulated at most in a frame, so that none takes long. Range 1 to 10000. Chosen.
  int runs_per_frame = 64;
  /// share. Errors of the simulator, by which the standard deviations of the tracked poses are enlarged: this share of
  /// the path and of the turn since the start, ... Range 0 to 1. Chosen.
  double model_share = 0.025;
  /// m. ... at least this ... Range 0 to 0.1. Chosen.
  double shift_floor = 0.0015;
  /// rad. ... and this. Range 0 to 1. Chosen.
  double turn_floor = 0.015;
  /// s. Samples nearer to each other count as one. Range 0.01 to 1. Chosen.
  double correlation_time = 0.15;
  /// m/s. Standard deviation of the velocity with which something is let go, about the tracked one. Range 0 to 1.
  /// Chosen.
  double release_speed_error = 0.05;
  /// rad/s. ... and of the velocity of turning. Range 0 to 10. Chosen.
  double release_turn_error = 0.3;
  /// squared deviations. Mean squared standardised error of the best run beyond which nothing was explained. Range 1
  /// to 49. Chosen.
  double largest_misfit = 12.0;
  /// probability. That something else moved the object as it moved, whatever its parameters are. Range 0 to 1. Chosen.
  double other_cause = 0.01;
};

struct LearnReport {
  int runs = 0;
  int lessons = 0;      ///< Episodes that changed weights.
  int unexplained = 0;  ///< That no draw explained; nothing was changed.
  std::string failure;  ///< Why an episode could not be simulated; "" = all could.
};

/// Follows the motion of each object of the belief, whose poses and states are those of its last frame, and judges
/// episodes that have ended, some runs a frame. Of objects without uncertain parameters, and with `simulators` empty,
/// only the motion is followed.
LearnReport learn_physics(belief::Belief& belief, const LearnPhysicsOptions& options,
                          const simulation::SimulatorFactory& simulators, core::ThreadPool& threads);

}  // namespace prescene::filter
