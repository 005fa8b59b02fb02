// SPDX-License-Identifier: Apache-2.0
// What every simulated answer says of the instances that it rests on.
#pragma once

#include <string>
#include <vector>

#include "prescene/belief/prediction.h"
#include "tasks.h"

namespace prescene::queries {

/// All but the remarks.
void account(const Foresight& foresight, belief::Basis& basis);

/// Sentences on failed and doubtful instances, and on intervals that did not reach the tolerance.
std::vector<std::string> remarks_of(const belief::Basis& basis, const belief::Effort& effort);
/// The remark that names parts which were not worked out in time.
std::string missing_text(const std::vector<std::string>& missing);
/// What is too far away is not simulated any more: what is said of it then may not be what is meant.
void remark_on_leaving(const simulation::OutcomeEstimate& estimate, std::vector<std::string>& remarks);
/// Actions that change nothing, or not what they seem to: of what nothing holds, or after the end.
void remark_on_actions(const belief::Scene& scene, double duration, std::vector<std::string>& remarks);
/// Where there is but one way that it can go.
void remark_on_certainty(const simulation::OutcomeEstimate& estimate, std::vector<std::string>& remarks);

}  // namespace prescene::queries
