// SPDX-License-Identifier: Apache-2.0
// What a step costs with hollow things in contact: as spheres, as convex parts in the same simulator, and in Bullet as
// shipped with the same convex parts and with GImpact.
#pragma once

#include "benchmarks/report.h"

namespace prescene::benchmarks {

/// Adds the ratio to Bullet's convex decomposition to the report, and returns the table of times. `repeats` runs of
/// each, of which the median counts.
Table measure_tree_contacts(int repeats, Report* report);

}  // namespace prescene::benchmarks
