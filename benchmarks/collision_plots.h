// SPDX-License-Identifier: Apache-2.0
// Collision measurements as charts.
#pragma once

#include <vector>

#include "benchmarks/collision_measure.h"
#include "benchmarks/plot.h"

namespace prescene::benchmarks {

/// Times of all algorithms over the distances, and how many times faster than FCL the default tree is for each pair.
std::vector<Plot> query_plots(const Measurements& measurements);
/// Times over k, over the branching and over the builders.
std::vector<Plot> study_plots(const Measurements& study);

}  // namespace prescene::benchmarks
