// SPDX-License-Identifier: Apache-2.0
#include "prescene/belief/observed_timeline.h"

#include <algorithm>
#include <sstream>

#include "prescene/core/check.h"
#include "prescene/core/spelling.h"

namespace prescene::belief {
namespace {

template <class Enum>
std::string word_for(const std::vector<std::pair<std::string, Enum>>& words, Enum value) {
  const auto found = std::find_if(words.begin(), words.end(), [&](const auto& word) { return word.second == value; });
  PRESCENE_CHECK(found != words.end());
  return found->first;
}

bool fits(const IntervalPattern& pattern, const ObservedInterval& interval) {
  if (pattern.relation != interval.relation) return false;
  const auto is = [](const std::string& wanted, const std::string& name) { return wanted.empty() || wanted == name; };
  if (is(pattern.subject, interval.subject) && is(pattern.other, interval.other)) return true;
  return pattern.relation == RelationKind::kTouches && is(pattern.subject, interval.other) &&
         is(pattern.other, interval.subject);
}

/// Of two intervals; one that began in the newest frame and goes on has no length yet, and is taken to go on a little.
AllenRelation relation_of(const ObservedInterval& a, const ObservedInterval& b) {
  const auto end = [](const ObservedInterval& interval) {
    return static_cast<double>(std::max(interval.end_ns, interval.begin_ns + 1));
  };
  return allen_relation(static_cast<double>(a.begin_ns), end(a), static_cast<double>(b.begin_ns), end(b));
}

/// Whether the ends of intervals that go on decide.
bool is_open(const ObservedInterval& a, const ObservedInterval& b, AllenRelation relation) {
  if (!a.goes_on && !b.goes_on) return false;
  switch (relation) {
    case AllenRelation::kBefore:
    case AllenRelation::kMeets:
      return a.goes_on;
    case AllenRelation::kAfter:
    case AllenRelation::kMetBy:
      return b.goes_on;
    case AllenRelation::kOverlaps:
    case AllenRelation::kStarts:
    case AllenRelation::kDuring:  // the first has ended
      return a.goes_on;
    case AllenRelation::kContains:
    case AllenRelation::kStartedBy:
    case AllenRelation::kOverlappedBy:
      return b.goes_on;
    case AllenRelation::kEquals:
    case AllenRelation::kFinishes:
    case AllenRelation::kFinishedBy:
      return true;
  }
  PRESCENE_CHECK_MSG(false, "an AllenRelation outside of its enumeration");
}

}  // namespace

const std::vector<std::pair<std::string, RelationKind>>& relation_words() {
  static const std::vector<std::pair<std::string, RelationKind>> kWords{
      {"on", RelationKind::kOn},           {"supports", RelationKind::kSupports},
      {"in", RelationKind::kIn},           {"touches", RelationKind::kTouches},
      {"holds", RelationKind::kHolds},     {"upright", RelationKind::kUpright},
      {"visible", RelationKind::kVisible}, {"within_reach", RelationKind::kWithinReach},
      {"present", RelationKind::kPresent}, {"moves", RelationKind::kMoves},
      {"falls", RelationKind::kFalls},     {"hidden", RelationKind::kHidden},
      {"appears", RelationKind::kAppears}, {"disappears", RelationKind::kDisappears}};
  return kWords;
}

std::string to_string(RelationKind kind) { return word_for(relation_words(), kind); }

bool is_between_two(RelationKind kind) { return kind <= RelationKind::kHolds; }

const std::vector<std::pair<std::string, AllenRelation>>& allen_words() {
  static const std::vector<std::pair<std::string, AllenRelation>> kWords{
      {"before", AllenRelation::kBefore},
      {"meets", AllenRelation::kMeets},
      {"overlaps", AllenRelation::kOverlaps},
      {"starts", AllenRelation::kStarts},
      {"during", AllenRelation::kDuring},
      {"finishes", AllenRelation::kFinishes},
      {"equals", AllenRelation::kEquals},
      {"finished_by", AllenRelation::kFinishedBy},
      {"contains", AllenRelation::kContains},
      {"started_by", AllenRelation::kStartedBy},
      {"overlapped_by", AllenRelation::kOverlappedBy},
      {"met_by", AllenRelation::kMetBy},
      {"after", AllenRelation::kAfter}};
  return kWords;
}

std::string to_string(AllenRelation relation) { return word_for(allen_words(), relation); }

AllenRelation allen_relation(double a, double b, double c, double d) {
  PRESCENE_CHECK(a < b && c < d);
  if (b < c) return AllenRelation::kBefore;
  if (b == c) return AllenRelation::kMeets;
  if (d < a) return AllenRelation::kAfter;
  if (d == a) return AllenRelation::kMetBy;
  if (a == c) {
    if (b == d) return AllenRelation::kEquals;
    return b < d ? AllenRelation::kStarts : AllenRelation::kStartedBy;
  }
  if (b == d) return a > c ? AllenRelation::kFinishes : AllenRelation::kFinishedBy;
  if (a < c) return b < d ? AllenRelation::kOverlaps : AllenRelation::kContains;
  return b < d ? AllenRelation::kDuring : AllenRelation::kOverlappedBy;
}

AllenRelation converse(AllenRelation relation) {
  // They are listed so that a relation and its converse lie opposite to each other.
  return static_cast<AllenRelation>(static_cast<int>(AllenRelation::kAfter) - static_cast<int>(relation));
}

core::Result<IntervalPattern> pattern_from_text(const std::string& text) {
  std::istringstream words(text);
  std::vector<std::string> parts;
  for (std::string word; words >> word;) parts.push_back(word);
  std::vector<std::string> known;
  for (const auto& [word, kind] : relation_words()) known.push_back(word);
  if (parts.empty()) return core::invalid_input("it is empty: give a relation and names, as 'touches carton mug'");
  const auto found = std::find(known.begin(), known.end(), parts[0]);
  if (found == known.end()) {
    if (parts[0] == "*")
      return core::invalid_input("'*' stands for a name, not for a relation: begin with one of " +
                                 core::comma_list(known));
    const std::string near = core::did_you_mean(parts[0], known);
    return core::invalid_input("'" + parts[0].substr(0, 40) + "' is no relation: " + near + (near.empty() ? "" : " ") +
                               "The relations are " + core::comma_list(known));
  }
  IntervalPattern pattern;
  pattern.relation = relation_words()[static_cast<std::size_t>(found - known.begin())].second;
  const std::size_t most = is_between_two(pattern.relation) ? 3 : 2;
  if (parts.size() > most)
    return core::invalid_input("'" + *found + "' is " + (most == 3 ? "between two things" : "of one thing") + ", and " +
                               std::to_string(parts.size() - 1) + " names are given: leave some out");
  const auto name = [&](std::size_t i) { return i < parts.size() && parts[i] != "*" ? parts[i] : std::string(); };
  pattern.subject = name(1);
  pattern.other = name(2);
  return pattern;
}

TimelineAnswer match(const ObservedTimeline& timeline, const TimelineQuery& query, std::size_t most_pairs) {
  TimelineAnswer answer;
  answer.of_pairs = query.second.has_value();
  answer.timeline = timeline;
  if (!query.first) return answer;
  std::vector<ObservedInterval>& kept = answer.timeline.intervals;
  std::erase_if(kept, [&](const ObservedInterval& interval) {
    return !fits(*query.first, interval) && !(query.second && fits(*query.second, interval));
  });
  if (!query.second) return answer;
  for (std::size_t i = 0; i < kept.size(); ++i) {
    if (!fits(*query.first, kept[i])) continue;
    for (std::size_t j = 0; j < kept.size(); ++j) {
      if (i == j || !fits(*query.second, kept[j])) continue;
      const AllenRelation relation = relation_of(kept[i], kept[j]);
      if (!query.relations.empty() && std::ranges::find(query.relations, relation) == query.relations.end()) continue;
      answer.pairs.push_back({static_cast<int>(i), static_cast<int>(j), relation,
                              kept[i].probability * kept[j].probability, is_open(kept[i], kept[j], relation)});
    }
  }
  std::stable_sort(answer.pairs.begin(), answer.pairs.end(),
                   [](const auto& a, const auto& b) { return a.probability > b.probability; });
  if (answer.pairs.size() > most_pairs) answer.pairs.resize(most_pairs);
  return answer;
}

}  // namespace prescene::belief
