// SPDX-License-Identifier: Apache-2.0
// Observation anticipation: which of some views would say most.
#pragma once

#include <span>

#include "prescene/belief/belief.h"
#include "prescene/belief/next_view.h"
#include "prescene/core/status.h"
#include "prescene/queries/query_engine.h"
#include "prior.h"

namespace prescene::queries {

/// Of an object that takes part in the prior, others as likely there as it says. `particles`: the object's, where a
/// belief has them.
core::Result<belief::NextViewAnswer> next_view(const Prior& prior, const belief::NextViewQuery& query,
                                               const QueryContext& context,
                                               std::span<const belief::Particle> particles = {});
/// Also of an object that is lost or probably not there.
core::Result<belief::NextViewAnswer> next_view(const belief::Belief& belief, const belief::NextViewQuery& query,
                                               const QueryContext& context);

}  // namespace prescene::queries
