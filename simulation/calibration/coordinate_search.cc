// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/calibration/coordinate_search.h"

#include <algorithm>

namespace prescene::simulation {

SearchResult coordinate_search(const std::vector<SearchParameter>& parameters,
                               const std::function<double(std::span<const double>)>& cost, int halvings,
                               int max_evaluations, const SearchProgress& progress) {
  SearchResult best;
  std::vector<double> steps;
  for (const SearchParameter& p : parameters) {
    best.values.push_back(std::clamp(p.value, p.low, p.high));
    steps.push_back(p.step);
  }
  best.cost = cost(best.values);
  best.evaluations = 1;
  bool stopped = progress && !progress(best);

  const auto improves = [&](std::size_t i, double step) {
    if (stopped || best.evaluations >= max_evaluations) return false;
    std::vector<double> values = best.values;
    values[i] = std::clamp(values[i] + step, parameters[i].low, parameters[i].high);
    if (values[i] == best.values[i]) return false;
    const double c = cost(values);
    ++best.evaluations;
    const bool better = c < best.cost;
    if (better) {
      best.cost = c;
      best.values = std::move(values);
    }
    stopped = progress && !progress(best);
    return better;
  };

  while (halvings > 0 && !stopped && best.evaluations < max_evaluations) {
    bool gained = false;
    for (std::size_t i = 0; i < parameters.size(); ++i) {
      for (const double sign : {1.0, -1.0}) {
        if (!improves(i, sign * steps[i])) continue;
        gained = true;
        double step = 2.0 * steps[i];
        while (improves(i, sign * step)) step *= 2.0;
        break;
      }
    }
    if (!gained) {
      for (double& step : steps) step *= 0.5;
      --halvings;
    }
  }
  best.settled = halvings <= 0;
  return best;
}

}  // namespace prescene::simulation
