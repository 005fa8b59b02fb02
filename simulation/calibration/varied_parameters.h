// SPDX-License-Identifier: Apache-2.0
// The parameters of a motion calibration as numbers in a row: where a search begins, and how far it goes.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "motion_judge.h"
#include "prescene/simulation/calibration/coordinate_search.h"
#include "prescene/simulation/calibration/m_estimate.h"
#include "prescene/simulation/calibration/motion_calibration.h"

namespace prescene::simulation {

/// What is varied: the parameters that have a prior deviation, then the starts' noise (its logarithm) and the scatter
/// of friction.
class VariedParameters {
 public:
  VariedParameters(const MotionPrior& prior, double radius_of_gyration);

  /// Places of the free ones in a MotionPrior.
  const std::vector<std::size_t>& free() const { return free_; }
  /// Where the search begins, of the free parameters and the noise: at small, believed and large friction, as far as
  /// the prior leaves them open, and at large noise if any recording begins in flight. The one that is believed comes
  /// first.
  std::vector<std::vector<SearchParameter>> starts(bool any_flight) const;
  /// Of a search for the noise alone.
  static std::vector<SearchParameter> noise(const MotionHypothesis& at);
  std::vector<EstimatedParameter> estimated(const MotionHypothesis& at) const;

  /// With values of the free parameters.
  MotionHypothesis with_parameters(MotionHypothesis hypothesis, std::span<const double> values) const;
  static MotionHypothesis with_noise(MotionHypothesis hypothesis, std::span<const double> values);
  /// Of the values of a search.
  MotionHypothesis hypothesis_of(std::span<const double> values) const;

 private:
  MotionHypothesis fixed_;
  std::vector<std::size_t> free_;
  std::vector<EstimatedParameter> estimated_;
};

}  // namespace prescene::simulation
