// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/scene_files/problems.h"

#include <algorithm>

#include "prescene/core/spelling.h"
#include "prescene/interfaces/bytes/text.h"

namespace prescene::interfaces {
namespace {

constexpr std::size_t kMostProblems = 100;

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

void Problems::remark(const FilePlace& place, std::string_view key, std::string reason, std::string remedy) {
  if (remarks_.size() < kMostProblems) remarks_.push_back(problem_at(place, key, std::move(reason), std::move(remedy)));
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

std::string suggestion(std::string_view word, const std::vector<std::string>& known) {
  if (known.empty()) return {};
  const std::vector<std::string> nearest = core::nearest_words(word, known);
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
