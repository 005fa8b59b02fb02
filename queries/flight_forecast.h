// SPDX-License-Identifier: Apache-2.0
// For how long nothing can touch anything.
#pragma once

#include "foresee.h"
#include "prescene/belief/prediction.h"

namespace prescene::queries {

/// For how long nothing can touch anything, into `flight`. Nothing is set when stopped or without a shape store. Fails
/// where a shape can't be made of spheres, and when the objects can't be simulated each by itself.
core::Status forecast_flight(const Foresight& foresight, const Prior& prior, const QueryContext& context,
                             belief::PredictAnswer& answer);

}  // namespace prescene::queries
