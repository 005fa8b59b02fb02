// SPDX-License-Identifier: Apache-2.0
// Minimising a function of some ten numbers that is jagged, has several minima, and whose parameters hang together.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "prescene/core/random.h"
#include "prescene/simulation/calibration/coordinate_search.h"

namespace prescene::simulation {

/// Evolution strategy with covariance matrix adaptation, CMA-ES [Hansen & Ostermeier 2001; Hansen 2016], from each
/// parameter's value with its step as standard deviation. What would leave [low, high] is reflected. Ends when the
/// standard deviations of all parameters are below `accuracy` times their steps, or after `max_evaluations` of `cost`.
/// The result is the best that was tried. Deterministic.
SearchResult evolution_search(const std::vector<SearchParameter>& parameters,
                              const std::function<double(std::span<const double>)>& cost, double accuracy,
                              int max_evaluations, core::RandomStream stream, const SearchProgress& progress = {});

}  // namespace prescene::simulation
