// SPDX-License-Identifier: Apache-2.0
// Which relations held from when to when, from the beliefs of the last seconds.
//
//   RelationHistory history({.seconds = 20.0});
//   PRESCENE_RETURN_IF_ERROR(history.add(*snapshot, context));  // of each frame, or of as many as there is time for
//   const belief::TimelineAnswer answer = belief::match(*history.timeline(), question);
//   ... answer
//
// Only changes are kept: an interval begins in the frame in which a relation's probability reaches `begins` and ends in
// the frame in which it falls to `ends`; what lies between goes on as it was, so that noise makes no intervals. Memory
// is bounded by `most_intervals`, whatever happens.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

#include "prescene/belief/observed_timeline.h"
#include "prescene/queries/query_engine.h"

namespace prescene::queries {

struct KeptShapes;

struct HistoryOptions {
  double seconds = 20.0;              ///< What ended longer ago than this is forgotten; > 0.
  std::size_t most_intervals = 2048;  ///< Kept at once; > 0. About 300 bytes each.
  int draws = 64;                     ///< Of each belief, as RelationsQuery::draws.
  double begins = 0.6, ends = 0.4;    ///< Probabilities, 0 < ends <= begins < 1.
};

/// Not thread-safe; what timeline() gives may be handed to other threads.
class RelationHistory {
 public:
  explicit RelationHistory(const HistoryOptions& options);

  /// The relations of a belief, and what its objects do (present, moves, falls, hidden). Beliefs come in the order of
  /// their stamps; one that is not later than the last begins a new history, as clocks that go back do. A belief whose
  /// relations can't be worked out is counted, and changes nothing; the status says why. One without objects ends what
  /// went on.
  core::Status add(const belief::Belief& belief, const QueryContext& context);
  /// The same for relations that are known: those that are not named have a probability of 0.
  void add(core::TimeNs stamp_ns, const std::vector<belief::RelationProbability>& relations);
  /// Frames that there was no time for.
  void skip(std::uint64_t frames) { now_.skipped += frames; }
  /// A frame whose relations could not be worked out, and why.
  void fail(const std::string& why);

  /// What is kept, a copy that never changes; null before the first belief.
  std::shared_ptr<const belief::ObservedTimeline> timeline() const;

 private:
  using Key = std::tuple<belief::RelationKind, std::string, std::string>;
  struct Open {
    core::TimeNs begin_ns = 0;
    bool began_before = false;
    double sum = 0.0;  // of probabilities
    int frames = 0;
  };
  void close(const Key& key, const Open& open, core::TimeNs end_ns);
  void note_event(belief::RelationKind kind, const std::string& object, core::TimeNs stamp_ns, double probability);
  void forget();

  HistoryOptions options_;
  std::shared_ptr<KeptShapes> shapes_;
  std::map<Key, Open> open_;
  std::vector<belief::ObservedInterval> closed_;  // in the order in which they ended
  belief::ObservedTimeline now_;                  // without the intervals
};

/// Answers from QueryContext::timeline: kUnavailable without one, kNotFound for a name in the question that neither the
/// scene nor the belief nor the timeline knows, with the nearest.
core::Result<belief::TimelineAnswer> observed(const belief::Belief& belief, const belief::TimelineQuery& query,
                                              const QueryContext& context);
core::Result<belief::TimelineAnswer> observed(const belief::Scene& scene, const belief::TimelineQuery& query,
                                              const QueryContext& context);

}  // namespace prescene::queries
