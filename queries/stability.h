// SPDX-License-Identifier: Apache-2.0
// Whether an object stays as it is.
#pragma once

#include "prescene/belief/query.h"
#include "prescene/core/status.h"
#include "prescene/queries/query_engine.h"
#include "prior.h"
#include "so_far.h"

namespace prescene::queries {

core::Result<belief::StabilityAnswer> stability(const Prior& prior, const belief::StabilityQuery& query,
                                                const QueryContext& context,
                                                const SoFarSink<belief::StabilityAnswer>& so_far = {});

}  // namespace prescene::queries
