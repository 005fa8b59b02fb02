// SPDX-License-Identifier: Apache-2.0
// What particles that are worlds bring where objects touch: simulated sequences of a stack that is pushed, of a book
// that leans on a block, and of a thing in a cup, tracked with and without.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "benchmarks/report.h"
#include "prescene/core/parallel.h"

namespace prescene::benchmarks {

/// stack, leaning, in_cup.
const std::vector<std::string>& contact_kinds();

struct WorldsFigures {
  int frames = 0;
  int tracked = 0;             ///< Estimates in state tracked ...
  int wrong = 0;               ///< ... that are off by more than 2 cm or 15 degrees, up to symmetry.
  int all = 0;                 ///< Estimates.
  int in_region = 0;           ///< Of those tracked: within the 90 % ellipsoid of the position.
  int sure = 0;                ///< Of all: with a confidence of 0.99 or more ...
  int sure_right = 0;          ///< ... and right.
  double squared_miss = 0.0;   ///< Sum over all of (confidence - right)^2.
  std::vector<double> errors;  ///< m, of those tracked.
  std::vector<double> turns;   ///< rad
  double evaluations = 0.0;    ///< Poses that were compared with a frame.
  double cpu_seconds = 0.0;    ///< Of the filter.
  int joint_islands = 0;       ///< Summed over frames.

  void add(const WorldsFigures& more);
};

/// One sequence of 50 frames of 320 x 240 pixels at 30 Hz, with the noise of the simulated suite's camera; `seed` is
/// for the scene, the camera's noise and the tracker.
WorldsFigures track_contacts(const std::string& kind, std::uint64_t seed, bool joint, int particles,
                             core::ThreadPool& threads);

/// Rows for `sequences` of each kind: joint, independent, and independent with so many particles that it makes about as
/// many evaluations as joint.
Table worlds_table(std::uint64_t seed, int sequences, core::ThreadPool& threads);

}  // namespace prescene::benchmarks
