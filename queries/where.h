// SPDX-License-Identifier: Apache-2.0
// Actual belief: where everything is.
#pragma once

#include "prescene/belief/belief.h"
#include "prescene/belief/query.h"
#include "prescene/belief/scene.h"
#include "prescene/core/status.h"

namespace prescene::queries {

core::Result<belief::WhereAnswer> where(const belief::Belief& belief, const belief::WhereQuery& query);
core::Result<belief::WhereAnswer> where(const belief::Scene& scene, const belief::WhereQuery& query);

}  // namespace prescene::queries
