// SPDX-License-Identifier: Apache-2.0
// Counts what an evaluation of tracking asks of one sequence: beliefs against the truth of the same stamp.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "prescene/service/belief_summary.h"
#include "prescene/service/evaluate/tracking_suite.h"
#include "prescene/service/recording/simulated_recording.h"

namespace prescene::service {

class TrackingCounter {
 public:
  /// `scene`: as the tracker knows it, for the models' symmetries.
  explicit TrackingCounter(std::shared_ptr<const belief::Scene> scene) : scene_(std::move(scene)) {}
  void add(const BeliefSummary& summary) { summaries_[summary.stamp_ns] = summary; }
  void add(const TruthRecord& truth) { truths_[truth.stamp_ns] = truth; }
  /// Of all frames so far; one sequence, no processor time.
  TrackingFigures figures() const;

 private:
  std::shared_ptr<const belief::Scene> scene_;
  std::map<core::TimeNs, BeliefSummary> summaries_;
  std::map<core::TimeNs, TruthRecord> truths_;
};

}  // namespace prescene::service
