// SPDX-License-Identifier: Apache-2.0
// The event "other": an object that does anything. In each frame it is where it was in the one before, or anywhere
// about its start in any orientation, or not to be seen, whatever physics says.
#pragma once

#include <optional>
#include <vector>

#include "event_paths.h"
#include "window_likelihood.h"

namespace prescene::queries {

struct OtherMotion {
  double log_evidence = 0.0;
  double error = 0.0;                             ///< Standard error of that.
  std::vector<double> frames;                     ///< Its parts.
  std::vector<std::optional<belief::Pose>> path;  ///< The most probable one.
  double most_likely = 0.0;                       ///< Greatest log likelihood that was met, all frames together.
  int evaluations = 0;
};

/// The integral over poses is by importance sampling about where the object was tracked in a frame.
OtherMotion other_motion(const EventPaths& events, WindowLikelihood& likelihood, std::size_t object,
                         const std::vector<double>& times, const belief::EventPriors& priors,
                         const core::RandomStream& stream);

}  // namespace prescene::queries
