// SPDX-License-Identifier: Apache-2.0
// Who touches whom, and when.
#pragma once

#include "foresee.h"
#include "prescene/belief/prediction.h"

namespace prescene::queries {

/// Into `contact_times` and `contacts`, from instances that ran to rest with their contacts kept. False, and nothing,
/// when abandoned.
bool forecast_contacts(const Foresight& foresight, double confidence, const core::Cancellation* abandoned,
                       belief::PredictAnswer& answer);

}  // namespace prescene::queries
