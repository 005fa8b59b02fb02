// SPDX-License-Identifier: Apache-2.0
// Operator 3, augment: what is behind something that nobody knows may be moved by it. A hand that comes in front of a
// thing may take it, and nothing shows that.
//
//   int moved = wander_unseen(frame, terms, target, evidence, dt, weighting, spread, tools, stream, object);
#pragma once

#include "prescene/filter/operators/initialise.h"
#include "prescene/filter/operators/weight.h"

namespace prescene::filter {

/// While an unseen object is mostly hidden by what nothing known explains (`evidence`: of its likeliest pose), each of
/// its resting particles is drawn anew once in a second on average. In three quarters of the draws the object was left
/// alone and is where it lay when it was seen last; in the others it was moved from there: to a place that is hidden
/// and free, as far as it may have come since then, from where physics takes it on. So moves do not add up. Where it
/// did not lie still, the place about which most of the weight is counts. Weights stay. Returns how many were moved.
/// What a hand holds stays in it. `dt`: since the last frame that it was seen or predicted in, s.
int wander_unseen(const FilterFrame& frame, const rendering::FrameTerms& terms, const SearchTarget& target,
                  const rendering::PoseEvidence& evidence, double dt, const WeightOptions& weighting,
                  const InitialiseOptions& spread, const FilterTools& tools, const core::RandomStream& stream,
                  belief::ObjectBelief& object);

}  // namespace prescene::filter
