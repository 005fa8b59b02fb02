// SPDX-License-Identifier: Apache-2.0
// Approximate convex decomposition by HACD [Mamou & Ghorbel 2009], from Bullet's extras.
#pragma once

#include "prescene/simulation/shape_store.h"

namespace prescene::simulation {

/// For ShapeStore. Seconds for some thousand triangles; deterministic.
Decomposer hacd_decomposer();

}  // namespace prescene::simulation
