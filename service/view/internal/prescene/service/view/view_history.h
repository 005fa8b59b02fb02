// SPDX-License-Identifier: Apache-2.0
// Confidence, state and learned parameters of each object over time, in bounded memory: of a long run every second
// row, then every fourth, and so on.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "prescene/service/belief_summary.h"

namespace prescene::service {

/// Not thread-safe.
class ViewHistory {
 public:
  explicit ViewHistory(std::size_t most_rows = 4000) : most_rows_(most_rows) {}

  struct Row {
    std::uint64_t index = 0;
    double time = 0.0;  ///< s since the first row's stamp.
    std::vector<double> values;
  };
  /// Takes a step in; false where it was left out, as its neighbours stand for it. Other objects or parameters than
  /// before, or a stamp before the last, begin anew (columns() changes).
  bool add(const BeliefSummary& summary, std::uint64_t index);

  /// Of each object "NAME/state" (0 tracked, 1 doubtful, 2 unseen, 3 lost), "NAME/confidence", "NAME/existence", and of
  /// each parameter "NAME/PARAMETER" and "NAME/PARAMETER/deviation".
  const std::vector<std::string>& columns() const { return columns_; }
  const std::vector<Row>& rows() const { return rows_; }
  /// Changes whenever rows were taken away: who kept a copy needs a new one.
  std::uint64_t revision() const { return revision_; }
  double seconds_of(core::TimeNs stamp_ns) const { return 1e-9 * static_cast<double>(stamp_ns - first_ns_); }

 private:
  std::size_t most_rows_;
  std::vector<std::string> columns_;
  std::vector<Row> rows_;
  std::uint64_t stride_ = 1, seen_ = 0, revision_ = 0;
  core::TimeNs first_ns_ = 0, last_ns_ = 0;
};

/// [index, time, values...]
nlohmann::ordered_json to_json(const ViewHistory::Row& row);
/// {"op": "history", "columns", "rows"}
nlohmann::ordered_json to_json(const ViewHistory& history);

}  // namespace prescene::service
