// SPDX-License-Identifier: Apache-2.0
// How far an estimate is: what its caller is told while instances run.
#pragma once

#include <span>
#include <string>

#include "prescene/core/clock.h"
#include "prescene/core/progress.h"
#include "prescene/simulation/outcomes/outcome_estimator.h"

namespace prescene::simulation {

/// Forecasts how many instances the stop rule will take, from how the widest interval shrank so far.
class EstimateForecast {
 public:
  EstimateForecast(const EstimatorOptions& options, core::ProgressSink sink);

  /// After each growth of the net.
  void stage_done(std::span<const Variable> variables, const OutcomeEstimate& estimate);
  /// Tells the sink, if there is one, that so many instances are done.
  void report(double done);

 private:
  EstimatorOptions options_;
  core::ProgressSink sink_;
  core::Stopwatch watch_;
  double expected_;
  double first_count_ = 0.0, first_widest_ = 0.0;
  double shown_ = 0.0;
  std::string settled_;
};

}  // namespace prescene::simulation
