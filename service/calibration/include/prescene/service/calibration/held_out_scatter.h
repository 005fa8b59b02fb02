// SPDX-License-Identifier: Apache-2.0
// How much throws differ, by what recordings do that the model was not fitted to.
#pragma once

#include <optional>

#include "prescene/service/backends.h"
#include "prescene/service/calibration/toss_scores.h"

namespace prescene::service {

/// A recording with the scene whose model was fitted without it.
struct HeldOutMotion {
  simulation::RecordedMotion motion;
  simulation::RecordedRest rest;
  std::size_t number = 0;  ///< In the data set.
  std::size_t group = 0;   ///< Twins share one.
  std::size_t scene = 0;
};

struct HeldOutScatter {
  double factor = 1.0;  ///< On the scatter that was fitted.
  simulation::ThrowScatter scatter;
  /// Of the held-out recordings with that scatter. The parameters never saw them; the factor, one number, did.
  TossScores scores;
};

/// Fewest recordings that a scatter is fitted to.
inline constexpr std::size_t kLeastHeldOut = 12;

/// `fitted` times the factor in [1/4, 4] with which regions of 80, 90 and 95 % hold, together, as many of the
/// held-out recordings as they promise, found by halving the interval of its logarithm. Start noise and scatter keep
/// their ratio. Nothing for fewer than kLeastHeldOut recordings. The same random numbers for each factor. Fails as
/// forecast_motions() does.
core::Result<std::optional<HeldOutScatter>> held_out_scatter(const std::vector<HeldOutMotion>& motions,
                                                             const std::vector<belief::Scene>& scenes,
                                                             const simulation::ThrowScatter& fitted, Backends& backends,
                                                             const core::RandomStream& stream,
                                                             const core::ProgressSink& progress = {},
                                                             const core::Cancellation* cancellation = nullptr);

/// Forecasts of the motions, each with its scene, scored; what none of its samples rests in the world for is left out.
core::Result<std::vector<ScoredToss>> score_held_out(const std::vector<HeldOutMotion>& motions,
                                                     const std::vector<belief::Scene>& scenes,
                                                     const simulation::ThrowScatter& scatter, Backends& backends,
                                                     const core::RandomStream& stream,
                                                     const simulation::ForecastOptions& options = {},
                                                     const core::ProgressSink& progress = {},
                                                     const core::Cancellation* cancellation = nullptr);

}  // namespace prescene::service
