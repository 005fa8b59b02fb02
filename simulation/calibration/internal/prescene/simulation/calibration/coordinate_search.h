// SPDX-License-Identifier: Apache-2.0
// Minimising a costly function of a few numbers, such as how far simulated motions end from recorded ones.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

namespace prescene::simulation {

struct SearchParameter {
  std::string name;
  double value = 0.0;  ///< Start.
  double step = 0.0;   ///< First step, > 0; halved whenever a whole round brings nothing.
  double low = 0.0;    ///< The value stays in [low, high].
  double high = 0.0;

  friend bool operator==(const SearchParameter&, const SearchParameter&) = default;
};

struct SearchResult {
  std::vector<double> values;
  double cost = 0.0;
  int evaluations = 0;
  bool settled = false;  ///< Else it ended at its evaluations, or was stopped.
};

/// Called after each evaluation with the best so far; false stops the search.
using SearchProgress = std::function<bool(const SearchResult& best)>;

/// Compass search [Kolda, Lewis & Torczon 2003]: each coordinate in turn one step up and down, keeping what is better,
/// going on in a direction that helped with twice its step. Ends after `halvings` rounds without gain or
/// `max_evaluations` of `cost`. Deterministic; finds a local minimum.
SearchResult coordinate_search(const std::vector<SearchParameter>& parameters,
                               const std::function<double(std::span<const double>)>& cost, int halvings,
                               int max_evaluations, const SearchProgress& progress = {});

}  // namespace prescene::simulation
