// SPDX-License-Identifier: Apache-2.0
// The smallest change of an event, or of where its object was at the begin, that would have led to a wanted outcome.
//
// The latent coordinates of an event are standard normal under the priors (event_paths.h), so that the length of a
// shift of all of an event's posterior draws is a number of standard deviations. The shortest shift for which the
// outcome has the wanted probability is looked for along single coordinates, then by the cross-entropy method
// [Rubinstein 1999] over all; what was found is told with draws of the posterior that had no part in finding it.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "event_paths.h"
#include "wanted_outcome.h"

namespace prescene::queries {

struct ChangeSearch {
  EventPaths* events = nullptr;
  Hypothesis hypothesis;
  /// Empty: the object ends tilted by at most 30 degrees from where it was when the event began, and at most 5 cm
  /// lower.
  std::optional<WantedOutcome> wanted;
  double probability = 0.9;  ///< That is wanted.
  double confidence = 0.95;  ///< Of the interval.
  /// Draws of the event's posterior, all as probable; those of different numbers are independent.
  std::function<std::vector<LatentPoint>(int number)> draws;
  std::uint64_t seed = 1;
  const core::Cancellation* cancellation = nullptr;
};

/// What was stopped is not found.
SmallestChange smallest_change(const ChangeSearch& search);

}  // namespace prescene::queries
