// SPDX-License-Identifier: Apache-2.0
// Which class of each variable a finished run is of.
#pragma once

#include <span>
#include <vector>

#include "prescene/simulation/outcomes/certifier.h"
#include "prescene/simulation/outcomes/outcome_estimator.h"

namespace prescene::simulation {

/// One class a variable; -1 for all of a run that diverged. Of a run that `certifier` ended (kDecided) what it decided,
/// else what the variables see in it. `duration` is that of the run's StopRule. Not of cancelled runs.
std::vector<int> classes_of(const belief::Trajectory& run, std::span<const Variable> variables,
                            const Certifier* certifier, double duration);

}  // namespace prescene::simulation
