// SPDX-License-Identifier: Apache-2.0
// RapidCheck with a seed that does not change from run to run, so that a law that held yesterday is tried on the same
// cases today. RapidCheck prints "Using configuration: seed=..."; the environment variable RC_PARAMS sets another.
#pragma once

#include <rapidcheck.h>

#include <cstdlib>

namespace prescene::tests {

/// RapidCheck reads its configuration at its first use, which is after all variables like this one are made.
inline const int kLawSeedIsSet = setenv("RC_PARAMS", "seed=20220", 0);

}  // namespace prescene::tests
