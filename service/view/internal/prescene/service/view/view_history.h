// SPDX-License-Identifier: Apache-2.0
// Confidence, state and learned parameters of each object over time, in bounded memory: of a long run every second
// row, then every fourth, and so on. When each state began is kept apart from the rows, so that no change is lost with
// them.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "prescene/service/belief_summary.h"

namespace prescene::service {

/// Not thread-safe.
class ViewHistory {
 public:
  /// `most_columns`: 32 MB of rows by default; some 50 objects with what is learned of them.
  explicit ViewHistory(std::size_t most_rows = 4000, std::size_t most_runs = 4000, std::size_t most_columns = 1024)
      : most_rows_(most_rows), most_runs_(most_runs), most_columns_(most_columns) {}

  /// Bytes of a run's hand: of a longer name the beginning is kept, and "..." after it.
  static constexpr std::size_t kMostHandBytes = 256;

  struct Row {
    std::uint64_t index = 0;
    double time = 0.0;           ///< s since the first row's stamp.
    std::vector<double> values;  ///< NaN where there was no such object or parameter yet.
  };
  /// An object's state from a step on, until its next run begins or the history ends.
  struct Run {
    std::size_t object = 0;  ///< As objects() has them.
    std::uint64_t index = 0;
    double time = 0.0;  ///< s, as a row's.
    belief::TrackState state = belief::TrackState::kTracked;
    std::string held_by;  ///< The hand; "" = free.
  };
  /// Takes a step in; false where it was left out, as its neighbours stand for it. Objects and parameters may join
  /// (columns() changes). Where one is missing that was there before, or after a stamp before the last, it begins anew;
  /// forgotten_steps() counts those before. Of the objects, the first whose columns fit are taken in;
  /// left_out_objects() counts the others.
  bool add(const BeliefSummary& summary, std::uint64_t index);

  /// Of each object "NAME/state" (0 tracked, 1 doubtful, 2 unseen, 3 lost), "NAME/confidence", "NAME/existence", and of
  /// each parameter "NAME/PARAMETER" and "NAME/PARAMETER/deviation".
  const std::vector<std::string>& columns() const { return columns_; }
  const std::vector<Row>& rows() const { return rows_; }
  const std::vector<std::string>& objects() const { return objects_; }
  /// In the order in which they began. Of more than `most_runs`, those that are shorter than shortest_run() are joined
  /// to what went before; joined_runs() counts them.
  const std::vector<Run>& runs() const { return runs_; }
  double shortest_run() const { return shortest_run_; }  ///< s; 0 = none was joined.
  std::uint64_t joined_runs() const { return joined_; }
  std::uint64_t forgotten_steps() const { return forgotten_; }
  /// Of the step that had most too many.
  std::size_t left_out_objects() const { return left_out_; }
  /// Changes whenever rows, runs or columns are others than before: who kept a copy needs a new one.
  std::uint64_t revision() const { return revision_; }
  double seconds_of(core::TimeNs stamp_ns) const { return 1e-9 * static_cast<double>(stamp_ns - first_ns_); }

 private:
  using Objects = std::span<const ObjectSummary>;
  Objects that_fit(const std::vector<ObjectSummary>& objects) const;
  void begin_anew(core::TimeNs stamp_ns, Objects objects, std::vector<std::string>&& columns);
  bool make_room_for(Objects objects, const std::vector<std::string>& columns);
  void add_runs(core::TimeNs stamp_ns, Objects objects, std::uint64_t index);
  void join_short_runs();

  std::size_t most_rows_, most_runs_, most_columns_, left_out_ = 0;
  std::vector<std::string> columns_, objects_;
  std::vector<Row> rows_;
  std::vector<Run> runs_;
  std::vector<std::optional<std::pair<belief::TrackState, std::string>>> current_;  // of each object: state and hand
  double shortest_run_ = 0.0;
  std::uint64_t joined_ = 0, forgotten_ = 0;
  std::uint64_t stride_ = 1, seen_ = 0, revision_ = 0;
  core::TimeNs first_ns_ = 0, last_ns_ = 0;
};

/// [index, time, values...], with null for NaN
nlohmann::ordered_json to_json(const ViewHistory::Row& row);
/// [object's place, index, time, state, held_by], with null for a free one
nlohmann::ordered_json to_json(const ViewHistory::Run& run);
/// {"op": "history", "columns", "rows", "objects", "runs", "shortest_run", "joined_runs",
/// "forgotten_steps", "left_out_objects"}
nlohmann::ordered_json to_json(const ViewHistory& history);

}  // namespace prescene::service
