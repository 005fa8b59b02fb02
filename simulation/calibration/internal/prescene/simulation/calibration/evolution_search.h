// SPDX-License-Identifier: Apache-2.0
// Minimising a function of some ten numbers that is jagged, has several minima, and whose parameters hang together.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "prescene/core/random.h"
#include "prescene/simulation/calibration/coordinate_search.h"

namespace prescene::simulation {

/// When a search has found what it can: then it is settled.
struct SearchEnd {
  double accuracy = 0.0;  ///< The standard deviations of all parameters are below this times their steps.
  /// Or the best cost gained less than `gain` in so many evaluations; 0 for never.
  int patience = 0;
  double gain = 0.0;
};

/// Evolution strategy with covariance matrix adaptation, CMA-ES [Hansen & Ostermeier 2001; Hansen 2016], from each
/// parameter's value with its step as standard deviation. What would leave [low, high] is reflected. Deterministic.
class EvolutionSearch {
 public:
  using Cost = std::function<double(std::span<const double>)>;

  EvolutionSearch(std::vector<SearchParameter> parameters, const SearchEnd& end, core::RandomStream stream);
  ~EvolutionSearch();
  EvolutionSearch(EvolutionSearch&&) noexcept;
  EvolutionSearch& operator=(EvolutionSearch&&) noexcept;

  /// Goes on until it settles, `progress` stops it, or so many evaluations of `cost` were made, those of earlier calls
  /// counted; a generation that they cut is lost to later calls.
  void run(const Cost& cost, int max_evaluations, const SearchProgress& progress = {});
  /// The best that was tried; without values before anything was.
  const SearchResult& best() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace prescene::simulation
