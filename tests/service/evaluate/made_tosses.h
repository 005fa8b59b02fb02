// SPDX-License-Identifier: Apache-2.0
// Tosses of a cube whose truth is known.
#pragma once

#include <vector>

#include "prescene/service/evaluate/cube_data.h"
#include "prescene/service/evaluate/cube_model.h"

namespace prescene::service::tests {

/// Tosses simulated with `model` and seen without noise, as the tracker would.
std::vector<CubeToss> made_tosses(const CubeModel& model, int count);

}  // namespace prescene::service::tests
