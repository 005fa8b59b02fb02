// SPDX-License-Identifier: Apache-2.0
// The smallest change of an event, or of where its object was at the start, that would have led to a wanted outcome.
//
// The latent coordinates of an event are standard normal under the priors (event_paths.h), so that the length of a
// shift of all of an event's posterior draws is a number of standard deviations. The shortest shift that leads to the
// outcome in a few draws is looked for (shift_search.h), and tested with others of the posterior that had no part in
// finding it. Where the test fails, the draws that refuted it join those of the search, which begins again
// (counterexample-guided synthesis [Solar-Lezama et al. 2006]).
#pragma once

#include <functional>
#include <vector>

#include "prescene/queries/changed_events.h"

namespace prescene::queries {

struct ChangeSearch {
  ChangedEvents* events = nullptr;
  std::string wanted;        ///< What the outcome is called.
  double probability = 0.9;  ///< That is wanted.
  double confidence = 0.95;  ///< Of the interval.
  /// Draws of the event's posterior, all as probable; those of different numbers are independent.
  std::function<std::vector<LatentPoint>(int number)> draws;
  std::uint64_t seed = 1;
  /// True once it is to end; what was stopped is not found.
  std::function<bool()> stopped;
};

/// Found is what is certain by its test: the lower end of the interval reaches the wanted probability.
SmallestChange smallest_change(const ChangeSearch& search);

}  // namespace prescene::queries
