// SPDX-License-Identifier: Apache-2.0
// How much work an answer may take.
#pragma once

#include <optional>

namespace prescene::belief {

/// Accuracy wanted and the limits of the work.
struct Effort {
  double tolerance = 0.02;   ///< Half width of the outcome intervals at which to stop.
  double confidence = 0.95;  ///< Of the intervals.
  int max_instances = 4096;
  std::optional<double> max_seconds;   ///< Wall time; the answer says how many instances it was worth.
  std::optional<int> exact_instances;  ///< Replay: run just this many.
  friend bool operator==(const Effort&, const Effort&) = default;
};

}  // namespace prescene::belief
