// SPDX-License-Identifier: Apache-2.0
#include "tests/interfaces/scene_files/yaml_edits.h"

#include <algorithm>

namespace prescene::tests {

using interfaces::LocatedValue;

std::vector<YamlKey> all_keys(const LocatedValue& document) {
  std::vector<YamlKey> keys;
  for (std::size_t i = 0; i < document.items.size(); ++i) {
    if (document.kind == LocatedValue::Kind::kMap)
      keys.push_back(
          {document.keys[i].name, document.path, document.keys[i].place.line, document.keys[i].place.column});
    const std::vector<YamlKey> below = all_keys(document.items[i]);
    keys.insert(keys.end(), below.begin(), below.end());
  }
  return keys;
}

std::vector<LocatedValue> all_scalars(const LocatedValue& document) {
  if (document.kind == LocatedValue::Kind::kScalar) return {document};
  std::vector<LocatedValue> scalars;
  for (const LocatedValue& item : document.items) {
    const std::vector<LocatedValue> below = all_scalars(item);
    scalars.insert(scalars.end(), below.begin(), below.end());
  }
  return scalars;
}

std::string replaced(const std::string& text, int line, int column, std::size_t length, const std::string& by) {
  std::size_t start = 0;
  for (int i = 1; i < line; ++i) start = text.find('\n', start) + 1;
  std::string result = text;
  return result.replace(start + static_cast<std::size_t>(column) - 1, length, by);
}

std::vector<std::string> slips(const std::string& word) {
  std::vector<std::string> result;
  const std::size_t middle = word.size() / 2;
  std::string dropped = word, doubled = word, changed = word;
  dropped.erase(middle, 1);
  doubled.insert(middle, 1, word[middle]);
  changed[middle] = changed[middle] == 'q' ? 'k' : 'q';
  result = {dropped, doubled, changed};
  for (std::size_t i = 0; i + 1 < word.size(); ++i) {
    if (word[i] == word[i + 1]) continue;
    std::string swapped = word;
    std::swap(swapped[i], swapped[i + 1]);
    result.push_back(swapped);
    break;
  }
  return result;
}

}  // namespace prescene::tests
