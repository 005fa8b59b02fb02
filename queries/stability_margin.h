// SPDX-License-Identifier: Apache-2.0
// How hard an object may be knocked before it falls, and what becomes of the others where it is taken away.
#pragma once

#include <cstddef>

#include "prescene/belief/query.h"
#include "prescene/core/status.h"
#include "prescene/queries/query_engine.h"
#include "prior.h"

namespace prescene::queries {

/// Simulates nothing that the question does not ask for; what the time did not suffice for is left empty. Fails where
/// no simulator can be made, and for the margin of what is held.
core::Status add_stability_detail(const Prior& prior, std::size_t object, const belief::StabilityQuery& query,
                                  const QueryContext& context, belief::StabilityAnswer& answer);

}  // namespace prescene::queries
