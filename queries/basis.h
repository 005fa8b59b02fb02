// SPDX-License-Identifier: Apache-2.0
// What every simulated answer says of the instances that it rests on.
#pragma once

#include <string>
#include <vector>

#include "foresee.h"
#include "prescene/belief/prediction.h"

namespace prescene::queries {

/// All but the remarks.
void account(const Foresight& foresight, belief::Basis& basis);
/// The same of an estimate on which the work goes on: nothing has stopped it.
void account_so_far(const Foresight& foresight, const simulation::OutcomeEstimate& so_far, belief::Basis& basis);

/// The remark that names parts which were not worked out in time.
std::string missing_text(const std::vector<std::string>& missing);
/// What is farther than `radius` (m) away is not simulated any more: what is said of it then may not be what is meant.
void remark_on_leaving(const simulation::OutcomeEstimate& estimate, double radius, std::vector<std::string>& remarks);
/// Where there is but one way that it can go.
void remark_on_certainty(const simulation::OutcomeEstimate& estimate, std::vector<std::string>& remarks);

}  // namespace prescene::queries
