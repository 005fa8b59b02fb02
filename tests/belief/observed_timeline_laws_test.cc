// SPDX-License-Identifier: Apache-2.0
// Allen's relations: just one is true of any two intervals, by definitions written down on their own.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "prescene/belief/json.h"
#include "prescene/belief/observed_timeline.h"
#include "tests/support/laws.h"

namespace prescene::belief::observed_timeline_laws_test {
namespace {

using ::testing::HasSubstr;

/// Whether a relation is true of [a, b) and [c, d), from the table of [Allen 1983].
bool is_true(AllenRelation relation, int a, int b, int c, int d) {
  switch (relation) {
    case AllenRelation::kBefore:
      return b < c;
    case AllenRelation::kAfter:
      return d < a;
    case AllenRelation::kMeets:
      return b == c;
    case AllenRelation::kMetBy:
      return d == a;
    case AllenRelation::kOverlaps:
      return a < c && c < b && b < d;
    case AllenRelation::kOverlappedBy:
      return c < a && a < d && d < b;
    case AllenRelation::kStarts:
      return a == c && b < d;
    case AllenRelation::kStartedBy:
      return a == c && b > d;
    case AllenRelation::kDuring:
      return a > c && b < d;
    case AllenRelation::kContains:
      return a < c && b > d;
    case AllenRelation::kFinishes:
      return b == d && a > c;
    case AllenRelation::kFinishedBy:
      return b == d && a < c;
    case AllenRelation::kEquals:
      return a == c && b == d;
  }
  return false;
}

TEST(AllenRelations, JustOneOfThirteenIsTrueOfAnyTwoIntervals) {
  ASSERT_EQ(allen_words().size(), 13u);
  int seen = 0;
  std::array<bool, 13> found{};
  for (int a = 0; a < 6; ++a)
    for (int b = a + 1; b < 7; ++b)
      for (int c = 0; c < 6; ++c)
        for (int d = c + 1; d < 7; ++d) {
          const AllenRelation relation = allen_relation(a, b, c, d);
          int holding = 0;
          for (const auto& [word, other] : allen_words()) holding += is_true(other, a, b, c, d) ? 1 : 0;
          ASSERT_EQ(holding, 1) << a << " " << b << " " << c << " " << d;
          ASSERT_TRUE(is_true(relation, a, b, c, d)) << to_string(relation);
          ASSERT_EQ(allen_relation(c, d, a, b), converse(relation)) << to_string(relation);
          found[static_cast<std::size_t>(relation)] = true;
          ++seen;
        }
  EXPECT_EQ(std::count(found.begin(), found.end(), true), 13) << seen;
}

TEST(AllenRelations, ItIsTheSameOfIntervalsThatAreShiftedAndStretched) {
  EXPECT_TRUE(tests::check_law([] {
    const auto end = [](int begin) { return begin + *rc::gen::inRange(1, 6); };
    const int a = *rc::gen::inRange(0, 8), c = *rc::gen::inRange(0, 8);
    const int b = end(a), d = end(c);
    const double shift = *rc::gen::inRange(-50, 50), stretch = 0.25 * *rc::gen::inRange(1, 20);
    const auto moved = [&](int t) { return shift + stretch * t; };
    RC_ASSERT(allen_relation(a, b, c, d) == allen_relation(moved(a), moved(b), moved(c), moved(d)));
  }));
}

ObservedTimeline two_intervals() {
  ObservedTimeline timeline;
  timeline.to_ns = 5'000'000'000;
  ObservedInterval touch{RelationKind::kTouches, "mug", "carton", 1'000'000'000, 2'000'000'000, false, false, 0.9, 10};
  ObservedInterval fall{RelationKind::kFalls, "carton", "", 3'000'000'000, 3'400'000'000, false, false, 0.8, 4};
  ObservedInterval on{RelationKind::kOn, "mug", "table", 0, 5'000'000'000, true, true, 1.0, 50};
  timeline.intervals = {on, touch, fall};
  return timeline;
}

TEST(TimelineQuery, DidTheCartonTouchTheMugBeforeItFell) {
  TimelineQuery query;
  query.first = *pattern_from_text("touches carton mug");
  query.second = *pattern_from_text("falls carton");
  query.relations = {AllenRelation::kBefore};
  const TimelineAnswer answer = match(two_intervals(), query);
  ASSERT_EQ(answer.pairs.size(), 1u);
  EXPECT_NEAR(answer.pairs[0].probability, 0.72, 1e-12);
  EXPECT_FALSE(answer.pairs[0].may_change);
  EXPECT_EQ(answer.timeline.intervals.size(), 2u);
  query.relations = {AllenRelation::kAfter};
  EXPECT_TRUE(match(two_intervals(), query).pairs.empty());
  query.relations.clear();
  query.second = *pattern_from_text("on * table");
  const TimelineAnswer during = match(two_intervals(), query);
  ASSERT_EQ(during.pairs.size(), 1u);
  EXPECT_EQ(during.pairs[0].relation, AllenRelation::kDuring);
}

TEST(TimelineQuery, QuestionsReadBackAsTheyWereWrittenAndMistakesAreNamed) {
  const char* text =
      R"({"id": "1", "timeline": {"first": "touches carton mug", "relation": ["before", "meets"],
          "second": {"relation": "falls", "subject": "carton"}}})";
  const auto query = query_from_json(text);
  ASSERT_TRUE(query.ok()) << query.status().message();
  EXPECT_EQ(*query, *query_from_json(json_text(to_json(*query))));
  const auto refused = [](const std::string& timeline) {
    return query_from_json("{\"timeline\": " + timeline + "}").status().message();
  };
  EXPECT_THAT(refused(R"({"first": "toches carton"})"), HasSubstr("did you mean 'touches'?"));
  EXPECT_THAT(refused(R"({"first": "falls carton mug"})"), HasSubstr("is of one thing"));
  EXPECT_THAT(refused(R"({"first": ""})"), HasSubstr("it is empty"));
  EXPECT_THAT(refused(R"({"second": "falls carton"})"), HasSubstr("needs a 'first'"));
  EXPECT_THAT(refused(R"({"first": "falls", "second": "moves", "relation": "beside"})"),
              HasSubstr("one of before, meets"));
  EXPECT_THAT(refused(R"({"first": "falls", "relation": "before"})"), HasSubstr("between two intervals"));
  EXPECT_THAT(refused(R"({"first": {"relation": "falls", "other": "x"}})"), HasSubstr("is of one thing"));
}

}  // namespace
}  // namespace prescene::belief::observed_timeline_laws_test
