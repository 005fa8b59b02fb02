// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/scene_files/problems.h"

#include <algorithm>

#include "prescene/interfaces/bytes/text.h"

namespace prescene::interfaces {
namespace {

constexpr std::size_t kMostProblems = 100;
// Words are compared letter by letter; longer ones than any key of ours are no slip of one.
constexpr std::size_t kLongestWord = 64;

Problem problem_at(const FilePlace& place, std::string_view key, std::string reason, std::string remedy) {
  return {place.file ? *place.file : std::string(),
          place.line,
          place.column,
          std::string(key),
          std::move(reason),
          std::move(remedy)};
}

std::string joined(const std::vector<std::string>& words, std::string_view last_separator) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (i > 0) text.append(i + 1 == words.size() ? last_separator : std::string_view(", "));
    text.append(interfaces::quote(words[i]));
  }
  return text;
}

}  // namespace

std::string Problem::text() const {
  std::string text = file;
  if (line > 0) text.append(":").append(std::to_string(line));
  for (const std::string* part : {&key, &reason, &remedy})
    if (!part->empty()) text.append(text.empty() ? "" : ": ").append(*part);
  return text;
}

void Problems::add(const FilePlace& place, std::string_view key, std::string reason, std::string remedy) {
  if (errors_.size() == kMostProblems) {
    ++left_off_;
    return;
  }
  errors_.push_back(problem_at(place, key, std::move(reason), std::move(remedy)));
}

void Problems::warn(const FilePlace& place, std::string_view key, std::string reason, std::string remedy) {
  if (warnings_.size() < kMostProblems)
    warnings_.push_back(problem_at(place, key, std::move(reason), std::move(remedy)));
}

core::Status Problems::status() const {
  if (errors_.empty()) return {};
  std::vector<Problem> sorted = errors_;
  std::stable_sort(sorted.begin(), sorted.end(), [](const Problem& a, const Problem& b) {
    return std::tie(a.file, a.line, a.column) < std::tie(b.file, b.line, b.column);
  });
  std::string text;
  for (const Problem& problem : sorted) text.append(text.empty() ? "" : "\n").append(problem.text());
  if (left_off_ > 0) text.append("\n... and " + std::to_string(left_off_) + " more problems");
  return core::invalid_input(text);
}

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

std::string suggestion(std::string_view word, const std::vector<std::string>& known) {
  if (known.empty()) return {};
  const std::vector<std::string> nearest = nearest_words(word, known);
  if (!nearest.empty()) return "did you mean " + joined(nearest, " or ") + "?";
  std::vector<std::string> sorted = known;
  std::sort(sorted.begin(), sorted.end());
  sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
  constexpr std::size_t kMostListed = 40;
  const bool cut = sorted.size() > kMostListed;
  if (cut) sorted.resize(kMostListed);
  return (sorted.size() == 1 ? "use " : "use one of ") + joined(sorted, cut ? ", " : " or ") + (cut ? ", ..." : "");
}

}  // namespace prescene::interfaces
