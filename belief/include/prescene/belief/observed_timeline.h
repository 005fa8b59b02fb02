// SPDX-License-Identifier: Apache-2.0
// The past as it was observed: from when to when a relation held, and how two such intervals lie to each other.
//
//   const AllenRelation how = allen_relation(0.0, 1.0, 1.0, 2.5);  // kMeets
//   ... how
//   const TimelineAnswer answer = match(timeline, question);
//   ... answer
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "prescene/belief/relations.h"
#include "prescene/core/clock.h"

namespace prescene::belief {

/// A relation held in the frames from `begin_ns` on until, without, that at `end_ns`.
struct ObservedInterval {
  RelationKind relation = RelationKind::kOn;
  std::string subject;
  std::string other;  ///< "" of what is not between two things.
  core::TimeNs begin_ns = 0;
  core::TimeNs end_ns = 0;    ///< Of what goes on: the newest frame; not less than begin_ns.
  bool goes_on = false;       ///< It still held in the newest frame.
  bool began_before = false;  ///< It held in the first frame that was looked at.
  double probability = 0.0;   ///< Mean over its frames, ...
  int frames = 0;             ///< ... which were so many.
  friend bool operator==(const ObservedInterval&, const ObservedInterval&) = default;
};

struct ObservedTimeline {
  core::TimeNs session_ns = 0;              ///< First frame that was ever looked at; seconds count from it.
  core::TimeNs from_ns = 0;                 ///< Of what ended before, nothing is kept.
  core::TimeNs to_ns = 0;                   ///< The newest frame.
  std::uint64_t frames = 0;                 ///< That were looked at; ...
  std::uint64_t skipped = 0;                ///< ... that came too fast for it; ...
  std::uint64_t failed = 0;                 ///< ... whose relations could not be worked out, the last because of
  std::string last_failure;                 ///< this.
  std::uint64_t forgotten = 0;              ///< Intervals that ended after from_ns, but for which there was no room.
  std::vector<ObservedInterval> intervals;  ///< By (begin, relation, subject, other).
  friend bool operator==(const ObservedTimeline&, const ObservedTimeline&) = default;
};

/// The thirteen ways in which two intervals lie to each other [Allen 1983]; just one is true of any two.
enum class AllenRelation {
  kBefore,    ///< The first ends before the second begins.
  kMeets,     ///< It ends when the second begins.
  kOverlaps,  ///< It begins first and ends within the second.
  kStarts,    ///< Both begin together, it ends first.
  kDuring,    ///< It is within the second.
  kFinishes,  ///< Both end together, it begins later.
  kEquals,
  kFinishedBy,  ///< The others are these with first and second exchanged.
  kContains,
  kStartedBy,
  kOverlappedBy,
  kMetBy,
  kAfter
};
const std::vector<std::pair<std::string, AllenRelation>>& allen_words();
std::string to_string(AllenRelation relation);
/// Of [a, b) and [c, d), of which neither may be empty (a < b and c < d, checked).
AllenRelation allen_relation(double a, double b, double c, double d);
AllenRelation converse(AllenRelation relation);

/// Which intervals are meant; what is empty may be anything. kTouches fits in either order.
struct IntervalPattern {
  RelationKind relation = RelationKind::kTouches;
  std::string subject;
  std::string other;
  friend bool operator==(const IntervalPattern&, const IntervalPattern&) = default;
};
/// "touches carton mug", "falls carton", "on carton *": kInvalidInput naming what is wrong, with the nearest words.
core::Result<IntervalPattern> pattern_from_text(const std::string& text);

/// Without `first`: all intervals. Without `second`: those of the first pattern. With both: the pairs of which one of
/// `relations` is true (empty: any, which is then reported).
struct TimelineQuery {
  std::optional<IntervalPattern> first, second;
  std::vector<AllenRelation> relations;
  friend bool operator==(const TimelineQuery&, const TimelineQuery&) = default;
};

struct TimelineAnswer {
  struct Pair {
    int first = 0, second = 0;  ///< Indices into `timeline.intervals`.
    AllenRelation relation = AllenRelation::kBefore;
    double probability = 0.0;  ///< Product of both intervals' own.
    /// An interval goes on: when it ends, the relation may be another one.
    bool may_change = false;
    friend bool operator==(const Pair&, const Pair&) = default;
  };
  ObservedTimeline timeline;  ///< With the intervals that were asked for.
  std::vector<Pair> pairs;    ///< Probable ones first.
  bool of_pairs = false;      ///< `second` was given.
  friend bool operator==(const TimelineAnswer&, const TimelineAnswer&) = default;
};
/// At most `most_pairs` pairs; which of several as probable is by their order.
TimelineAnswer match(const ObservedTimeline& timeline, const TimelineQuery& query, std::size_t most_pairs = 1000);

}  // namespace prescene::belief
