// SPDX-License-Identifier: Apache-2.0
// What happens, by simulating it over and over: the reference that answers are compared with.
#pragma once

#include <cstdint>
#include <vector>

#include "prescene/belief/scene.h"
#include "prescene/belief/trajectory.h"
#include "prescene/core/parallel.h"

namespace prescene::benchmarks {

/// Runs of Bullet's stepper with steps of `step` (s) from independent draws of the scene's starts and actions.
std::vector<belief::Trajectory> plain_runs(const belief::Scene& scene, int count, double step, std::uint64_t seed,
                                           core::ThreadPool& pool);

}  // namespace prescene::benchmarks
