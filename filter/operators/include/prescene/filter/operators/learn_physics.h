// SPDX-License-Identifier: Apache-2.0
// Learning physical parameters: when an object lay still and then was moved, or was let go, or lies still on what is
// tilted, that piece of its motion is simulated under each draw of its friction, mass, restitution and centre of mass,
// and the draws are weighted by how well they explain what was seen.
//
//   LearnReport report = learn_physics(belief, options, simulators, pool);   // once a frame, after weight
//
// Frames in which nothing happens change nothing. Posterior = prior times likelihood; the simulator's prediction of a
// whole piece of motion stands in for the likelihood of its frames, through the tracked poses and their covariances.
#pragma once

#include <string>

#include "prescene/belief/belief.h"
#include "prescene/simulation/simulator.h"

namespace prescene::filter {

struct LearnPhysicsOptions {
  bool enabled = true;
  int rest_frames = 10;        ///< An object that is tracked for so many frames without moving lies still.
  double start_shift = 0.008;  ///< m; it moves when it is further from where it lay, ...
  double start_turn = 0.09;    ///< rad; ... or turned further, each at least three of its standard deviations.
  double before = 0.4;         ///< s; an episode begins so long before motion was noticed.
  double longest = 2.0;        ///< s; what lasts longer is judged by its beginning.
  double longest_gap = 0.3;    ///< s; an episode in which the object is not tracked for longer is given up.
  int fewest_samples = 5;
  double rest_time = 0.5;  ///< s; what lies still is simulated for so long.
  int variants = 4;  ///< Starts a draw is simulated from, drawn from the start's covariance; the same for all draws.
  int runs_per_frame = 64;  ///< Simulated at most, so that no frame takes long.
  /// Errors of the simulator, by which the standard deviations of the tracked poses are enlarged: shares of the path
  /// and of the turn since the start, and these floors.
  double model_share = 0.025;
  double shift_floor = 0.0015;        ///< m
  double turn_floor = 0.015;          ///< rad
  double correlation_time = 0.15;     ///< s; samples nearer to each other count as one.
  double release_speed_error = 0.03;  ///< m/s, standard deviation of the velocity with which something is let go.
  double largest_misfit =
      12.0;  ///< Mean squared standardised error of the best run beyond which nothing was explained.
  /// Probability that something else moved the object as it moved, whatever its parameters are.
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
