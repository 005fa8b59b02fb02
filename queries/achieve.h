// SPDX-License-Identifier: Apache-2.0
// Which parameters of an action bring an outcome about: the search of parameter_search.h over simulated instances.
#pragma once

#include "prescene/belief/achieve.h"
#include "prescene/queries/query_engine.h"
#include "prior.h"
#include "so_far.h"

namespace prescene::queries {

core::Result<belief::AchieveAnswer> achieve(const Prior& prior, const belief::AchieveQuery& query,
                                            const QueryContext& context,
                                            const SoFarSink<belief::AchieveAnswer>& so_far = {});

}  // namespace prescene::queries
