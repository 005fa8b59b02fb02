// SPDX-License-Identifier: Apache-2.0
// Where each frame of a window says that an object is, with how it is spread.
#pragma once

#include <vector>

#include "event_paths.h"
#include "prescene/queries/path_error.h"
#include "window_likelihood.h"

namespace prescene::queries {

struct FoundPeaks {
  std::vector<FramePeak> peaks;  ///< By frame.
  int evaluations = 0;
};

/// By adaptive importance sampling [Cappé et al. 2004] about where the object was tracked in a frame; where it was not,
/// between where it was tracked before and after. `times`: of the frames.
FoundPeaks find_peaks(const EventPaths& events, WindowLikelihood& likelihood, std::size_t object,
                      const std::vector<double>& times, const core::RandomStream& stream);

}  // namespace prescene::queries
