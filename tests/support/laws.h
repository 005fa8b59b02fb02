// SPDX-License-Identifier: Apache-2.0
// RapidCheck with a seed that does not change from run to run, so that a law that held yesterday is tried on the same
// cases today. RapidCheck prints "Using configuration: seed=..."; the environment variable RC_PARAMS sets another.
//
//   EXPECT_TRUE(check_law([](std::uint64_t seed) { RC_ASSERT(std::to_string(seed).size() <= 20); }));
#pragma once

#include <rapidcheck.h>

#include <cstdint>
#include <cstdlib>
#include <functional>
#include <string>

namespace prescene::tests {

/// RapidCheck reads its configuration at its first use, which is after all variables like this one are made.
inline const int kLawSeedIsSet = setenv("RC_PARAMS", "seed=20220", 0);

/// Whether the law holds for a hundred seeds, with a text about the first that it does not hold for, as rc::check does.
/// That is compiled anew for each law that it is given, at half a second each; these are compiled once.
bool check_law(const std::function<void(std::uint64_t)>& law);
/// A law that draws its cases itself: `*numbers(0.0, 1.0)`.
bool check_law(const std::function<void()>& law);
/// With a text that RapidCheck prints.
bool check_law(const std::string& what, const std::function<void()>& law);

}  // namespace prescene::tests
