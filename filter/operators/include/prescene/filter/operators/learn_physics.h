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
  /// switch. Physical parameters are learned from motion. Range true or false. Chosen.
  bool enabled = true;
  /// count. At most this many runs are simulated in one frame, so that no frame takes long. Range 1 to 10000. Chosen.
  int runs_per_frame = 64;
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
