// SPDX-License-Identifier: Apache-2.0
// Which known word somebody meant who wrote another one.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace prescene::core {

/// Number of letters to add, drop, change or swap with a neighbour [Damerau 1964, optimal string alignment].
int edit_distance(std::string_view a, std::string_view b);

/// Those of `known` nearest to `word` (several on a tie), none when all are too far to be a slip.
std::vector<std::string> nearest_words(std::string_view word, const std::vector<std::string>& known);

}  // namespace prescene::core
