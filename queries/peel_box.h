// SPDX-License-Identifier: Apache-2.0
// Makes a box of parameters smaller until trials in it succeed often enough.
#pragma once

#include <span>

#include "prescene/queries/parameter_search.h"

namespace prescene::queries {

/// A trial in a box; periodic coordinates may lie beyond 0 and 1.
struct BoxSample {
  UnitPoint at;
  bool succeeded = false;
};

/// Takes slabs off the box, each time that whose loss gains most for the share of successes among the samples in the
/// rest [Friedman & Fisher 1999], until that share is `wanted` or few samples are left. The centre stays in the box.
void peel_box(const UnitPoint& centre, std::span<const BoxSample> samples, double wanted, UnitPoint& low,
              UnitPoint& high);

}  // namespace prescene::queries
