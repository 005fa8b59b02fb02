// SPDX-License-Identifier: Apache-2.0
// What the collision library is meant to reach, and what it reached.
#pragma once

#include "benchmarks/collision_measure.h"
#include "benchmarks/report.h"

namespace prescene::benchmarks {

/// Building trees; uses two threads.
void add_build_targets(Report* report);
/// Queries against other libraries and against each other.
void add_query_targets(const Measurements& measurements, Report* report);
/// Settings of our trees against each other.
void add_study_targets(const Measurements& study, Report* report);
/// Queries whose trees are in no cache.
void add_cold_targets(const Measurements& cold, Report* report);
/// Inner sphere trees: vector instructions against plain C++, uncertain poses against certain ones.
void add_sphere_targets(bool quick, Report* report);
/// Bytes of trees.
void add_memory_targets(const Measurements& measurements, Report* report);

}  // namespace prescene::benchmarks
