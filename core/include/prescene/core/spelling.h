// SPDX-License-Identifier: Apache-2.0
// Which known word somebody meant who wrote another one.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace prescene::core {

/// Number of letters to add, drop, change or swap with a neighbour [Damerau 1964, optimal string alignment]. Letters
/// are bytes: in UTF-8, one outside of ASCII counts as two to four.
int edit_distance(std::string_view a, std::string_view b);

/// Those of `known` nearest to `word` by edit_distance (several on a tie, in the order of `known`, each once), if at
/// most (n + 1) / 3 of its n letters (rounded down, at least one) are wrong. If none is so near: those that begin with
/// `word`, or with which it begins, when the shorter of the two has at least three letters. Distances are not taken of
/// words of more than 64 letters; for such a `word` the result is empty.
std::vector<std::string> nearest_words(std::string_view word, const std::vector<std::string>& known);

/// "did you mean 'mug'?", or "did you mean 'mug' or 'jug'?" of words that are equally near; empty if none is near.
std::string did_you_mean(std::string_view word, const std::vector<std::string>& known);

/// "mug, jug, bin", in the order given.
std::string comma_list(const std::vector<std::string>& words);

}  // namespace prescene::core
