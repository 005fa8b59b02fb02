// SPDX-License-Identifier: Apache-2.0
// What one should know before trusting the numbers, in sentences.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "prescene/belief/belief.h"
#include "prescene/belief/prediction.h"
#include "prescene/belief/query.h"
#include "prescene/belief/scene.h"
#include "prescene/simulation/outcomes/outcome_estimator.h"

namespace prescene::queries {

/// Sentences on failed and doubtful instances, and on intervals that did not reach the tolerance.
std::vector<std::string> remarks_of(const belief::Basis& basis, const belief::Effort& effort);
/// Sentences about what was found.
std::vector<std::string> remarks_of(const belief::PredictAnswer& answer, const belief::Effort& effort);
/// Actions that change nothing, or not what they seem to: of what nothing holds, or after the end.
void remark_on_actions(const belief::Scene& scene, double duration, std::vector<std::string>& remarks);

/// What the outcomes judge at the end and still moves freely then, in more than 2 % of the instances: beyond the speeds
/// of belief::is_moving, and not certified, so that the outcomes may be others later. `settled` says of a state that
/// its outcomes can't change any more; may be empty.
void remark_on_unfinished_motion(const belief::Scene& scene, const simulation::OutcomeEstimate& estimate,
                                 const simulation::StopRule& stop,
                                 const std::function<bool(const belief::WorldState&)>& settled,
                                 std::vector<std::string>& remarks);

/// Joints that are left out, as what they hang on, or what hangs on them, is not there now.
void remark_on_loose_joints(const belief::Belief& belief, std::vector<std::string>& remarks);

}  // namespace prescene::queries
