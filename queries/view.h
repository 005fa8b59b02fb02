// SPDX-License-Identifier: Apache-2.0
// Observation anticipation: what the camera will see.
#pragma once

#include "prescene/belief/query.h"
#include "prescene/core/status.h"
#include "prescene/queries/query_engine.h"
#include "prior.h"

namespace prescene::queries {

core::Result<belief::ViewAnswer> view(const Prior& prior, const belief::ViewQuery& query, const QueryContext& context);

}  // namespace prescene::queries
