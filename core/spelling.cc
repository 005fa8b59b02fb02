// SPDX-License-Identifier: Apache-2.0
#include "prescene/core/spelling.h"

#include <algorithm>

namespace prescene::core {
namespace {

// Words are compared letter by letter; longer ones than any key of ours are no slip of one.
constexpr std::size_t kLongestWord = 64;

}  // namespace

int edit_distance(std::string_view a, std::string_view b) {
  // Rows of the table of prefixes: two before, one before, current.
  std::vector<int> before(b.size() + 1), last(b.size() + 1), now(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) last[j] = static_cast<int>(j);
  for (std::size_t i = 1; i <= a.size(); ++i) {
    now[0] = static_cast<int>(i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      now[j] = std::min({last[j] + 1, now[j - 1] + 1, last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) now[j] = std::min(now[j], before[j - 2] + 1);
    }
    before.swap(last);
    last.swap(now);
  }
  return last[b.size()];
}

std::vector<std::string> nearest_words(std::string_view word, const std::vector<std::string>& known) {
  if (word.size() > kLongestWord) return {};
  std::vector<std::string> nearest;
  // A third of the letters wrong is a slip; half of a long word is another word.
  int best = std::max(1, static_cast<int>(word.size() + 1) / 3);
  for (const std::string& candidate : known) {
    if (candidate.size() > kLongestWord) continue;
    const int distance = edit_distance(word, candidate);
    if (distance > best) continue;
    if (distance < best) nearest.clear();
    best = distance;
    if (std::ranges::find(nearest, candidate) == nearest.end()) nearest.push_back(candidate);
  }
  if (!nearest.empty()) return nearest;
  // Half a key, or a key with something added: "euler" for "euler_deg", "mass_kg" for "mass".
  for (const std::string& candidate : known) {
    const std::string_view shorter = word.size() < candidate.size() ? word : candidate;
    const std::string_view longer = word.size() < candidate.size() ? std::string_view(candidate) : word;
    if (shorter.size() >= 3 && longer.substr(0, shorter.size()) == shorter) nearest.push_back(candidate);
  }
  return nearest;
}

std::string did_you_mean(std::string_view word, const std::vector<std::string>& known) {
  std::string text;
  for (const std::string& near : nearest_words(word, known))
    text += (text.empty() ? "did you mean '" : " or '") + near + "'";
  return text.empty() ? text : text + "?";
}

std::string comma_list(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

}  // namespace prescene::core
