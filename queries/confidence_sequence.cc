// SPDX-License-Identifier: Apache-2.0
#include "prescene/queries/confidence_sequence.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "prescene/core/check.h"
#include "prescene/simulation/outcomes/quantiles.h"

namespace prescene::queries {
namespace {

double log_beta(double a, double b) {
  return simulation::log_gamma(a) + simulation::log_gamma(b) - simulation::log_gamma(a + b);
}

}  // namespace

ShareInterval confidence_sequence(int successes, int draws, double error, const PriorOfShare& prior) {
  PRESCENE_CHECK(successes >= 0 && successes <= draws && error > 0.0 && error < 1.0);
  ShareInterval interval;
  if (draws == 0) return interval;
  const double s = successes, f = draws - successes;
  const double least = std::log(error) + log_beta(prior.a + s, prior.b + f) - log_beta(prior.a, prior.b);
  // The likelihood rises up to s / n and falls from there.
  const auto within = [&](double p) {
    return (s > 0.0 ? s * std::log(p) : 0.0) + (f > 0.0 ? f * std::log1p(-p) : 0.0) >= least;
  };
  const auto end_between = [&](double outside, double inside) {
    for (int i = 0; i < 60; ++i) {
      const double middle = 0.5 * (outside + inside);
      (within(middle) ? inside : outside) = middle;
    }
    return outside;
  };
  const double top = s / (s + f);
  if (successes > 0) interval.low = end_between(0.0, top);
  if (successes < draws) interval.high = end_between(1.0, top);
  return interval;
}

ShareInterval clopper_pearson(int successes, int draws, double error) {
  PRESCENE_CHECK(successes >= 0 && successes <= draws && error > 0.0 && error < 1.0);
  const double s = successes, f = draws - successes;
  ShareInterval interval;
  if (successes > 0) interval.low = simulation::beta_quantile(0.5 * error, s, f + 1.0);
  if (successes < draws) interval.high = simulation::beta_quantile(1.0 - 0.5 * error, s + 1.0, f);
  return interval;
}

QuantileInterval quantile_interval(std::span<const double> sorted, double share, double error) {
  PRESCENE_CHECK(!sorted.empty() && share > 0.0 && share < 1.0 && error > 0.0 && error < 1.0);
  const auto n = static_cast<int>(sorted.size());
  // The quantile lies below the k-th draw with the probability that fewer than k of n draws lie below the quantile.
  double mass = std::pow(1.0 - share, n), below = 0.0;  // of exactly k and of fewer than k
  int low = 0, high = n + 1;
  for (int k = 0; k <= n; ++k) {
    if (below <= 0.5 * error) low = k;
    if (1.0 - below <= 0.5 * error) high = std::min(high, k);
    below += mass;
    mass *= static_cast<double>(n - k) / (k + 1) * share / (1.0 - share);
  }
  const auto draw = [&](int rank) { return sorted[static_cast<std::size_t>(rank - 1)]; };
  QuantileInterval interval;
  interval.value = draw(std::max(1, static_cast<int>(std::ceil(share * n - 1e-9))));
  if (low > 0) interval.low = draw(low);
  if (high <= n) interval.high = draw(high);
  return interval;
}

}  // namespace prescene::queries
