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
};

/// The integral over poses is that of the frames' peaks, which `likelihood` must have of the object.
OtherMotion other_motion(const EventPaths& events, WindowLikelihood& likelihood, std::size_t object,
                         const belief::EventPriors& priors);

}  // namespace prescene::queries
