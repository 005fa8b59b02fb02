// SPDX-License-Identifier: Apache-2.0
// Events that are changed, by simulation.
#pragma once

#include <memory>
#include <optional>

#include "event_paths.h"
#include "prescene/queries/changed_events.h"
#include "wanted_outcome.h"

namespace prescene::queries {

/// Of a hypothesis about an object that is there at the start; runs go on for `goes_on` s after the window's end.
/// `events` must outlive it.
std::unique_ptr<ChangedEvents> changed_events(EventPaths& events, const Hypothesis& hypothesis,
                                              std::optional<WantedOutcome> wanted, double goes_on);

inline constexpr double kChangeGoesOn = 2.0;  ///< s after the window's end in which what an event leads to is looked at

}  // namespace prescene::queries
