// SPDX-License-Identifier: Apache-2.0
// Systematic damage to a YAML document: every key mistyped, every value replaced, with the place of each.
#pragma once

#include <string>
#include <vector>

#include "prescene/interfaces/scene_files/located_value.h"

namespace prescene::tests {

struct YamlKey {
  std::string name;
  std::string parent;  ///< Path of the map that it stands in.
  int line = 0;        ///< From 1.
  int column = 0;
};

std::vector<YamlKey> all_keys(const interfaces::LocatedValue& document);
std::vector<interfaces::LocatedValue> all_scalars(const interfaces::LocatedValue& document);

/// `text` with `length` characters at a place replaced.
std::string replaced(const std::string& text, int line, int column, std::size_t length, const std::string& by);
/// How often a hand slips: a letter dropped, doubled, changed, two swapped.
std::vector<std::string> slips(const std::string& word);

}  // namespace prescene::tests
