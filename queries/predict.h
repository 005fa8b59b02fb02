// SPDX-License-Identifier: Apache-2.0
// State anticipation: what happens if.
#pragma once

#include "prescene/belief/query.h"
#include "prescene/core/status.h"
#include "prescene/queries/query_engine.h"
#include "prior.h"
#include "so_far.h"

namespace prescene::queries {

core::Result<belief::PredictAnswer> predict(const Prior& prior, const belief::PredictQuery& query,
                                            const QueryContext& context,
                                            const SoFarSink<belief::PredictAnswer>& so_far = {});

}  // namespace prescene::queries
