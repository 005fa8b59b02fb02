// SPDX-License-Identifier: Apache-2.0
#include "benchmarks/statistics.h"

#include <algorithm>
#include <cmath>

#include "prescene/core/check.h"

namespace prescene::benchmarks {
namespace {

/// `share` in [0, 1] of the way through sorted values.
double quantile(const std::vector<double>& sorted, double share) {
  const double place = share * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(place);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  return std::lerp(sorted[below], sorted[above], place - static_cast<double>(below));
}

}  // namespace

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  return quantile(values, 0.5);
}

Summary summarize(std::span<const double> values) {
  Summary summary;
  if (values.empty()) return summary;
  summary.n = values.size();
  const auto n = static_cast<double>(values.size());
  for (const double value : values) summary.mean += value / n;
  double squares = 0.0;
  for (const double value : values) squares += (value - summary.mean) * (value - summary.mean);
  if (values.size() > 1) summary.standard_deviation = std::sqrt(squares / (n - 1.0));
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  summary.min = *low;
  summary.max = *high;
  summary.median = median({values.begin(), values.end()});
  std::vector<double> deviations;
  deviations.reserve(values.size());
  for (const double value : values) deviations.push_back(std::abs(value - summary.median));
  summary.median_absolute_deviation = median(std::move(deviations));
  return summary;
}

std::vector<double> without_outliers(std::span<const double> values) {
  if (values.empty()) return {};
  std::vector<double> sorted(values.begin(), values.end());
  std::sort(sorted.begin(), sorted.end());
  const double first = quantile(sorted, 0.25), third = quantile(sorted, 0.75), reach = 1.5 * (third - first);
  std::vector<double> kept;
  for (const double value : values)
    if (value >= first - reach && value <= third + reach) kept.push_back(value);
  return kept;
}

double geometric_mean(std::span<const double> values) {
  if (values.empty()) return 1.0;
  double logs = 0.0;
  for (const double value : values) {
    PRESCENE_CHECK(value > 0.0);
    logs += std::log(value);
  }
  return std::exp(logs / static_cast<double>(values.size()));
}

}  // namespace prescene::benchmarks
