// SPDX-License-Identifier: Apache-2.0
#include "estimate_forecast.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include "prescene/core/text.h"

namespace prescene::simulation {
namespace {

double widest_half(const OutcomeEstimate& estimate) {
  double widest = 0.0;
  for (const VariableEstimate& variable : estimate.variables)
    for (const ClassEstimate& one : variable.classes)
      widest = std::isnan(one.half_width) ? std::numeric_limits<double>::infinity() : std::max(widest, one.half_width);
  return widest;
}

/// The likeliest classes of the first variable, for progress: ", in_bin 0.62 +-0.03, ...".
std::string settled_text(std::span<const Variable> variables, const OutcomeEstimate& estimate) {
  constexpr std::size_t kShown = 3;
  if (estimate.variables.empty()) return {};
  const std::vector<ClassEstimate>& classes = estimate.variables[0].classes;
  std::vector<std::size_t> order(variables[0].name.empty() ? 1 : classes.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return classes[a].probability > classes[b].probability; });
  std::string text;
  for (std::size_t c : std::span(order).first(std::min(kShown, order.size())))
    text += ", " + variables[0].classes[c] + " " + core::fixed_text(classes[c].probability, 2) + " +-" +
            core::fixed_text(classes[c].half_width, 2);
  return text;
}

}  // namespace

EstimateForecast::EstimateForecast(const EstimatorOptions& options, core::ProgressSink sink)
    : options_(options), sink_(std::move(sink)) {
  expected_ = options.exact_instances ? *options.exact_instances : options.max_instances;
}

void EstimateForecast::stage_done(std::span<const Variable> variables, const OutcomeEstimate& estimate) {
  const auto count = static_cast<double>(estimate.instances.size());
  const double widest = widest_half(estimate);
  settled_ = settled_text(variables, estimate);
  if (options_.exact_instances) return;
  // Between the rates of independent draws (1/2) and of nets in smooth problems (1); 0.6 until two stages are known.
  double rate = 0.6;
  if (!std::isfinite(widest)) {
    expected_ = options_.max_instances;
    return;
  }
  if (first_count_ == 0.0) {
    first_count_ = count;
    first_widest_ = widest;
  } else if (widest > 0.0 && count > first_count_) {
    rate = std::clamp(std::log(first_widest_ / widest) / std::log(count / first_count_), 0.5, 1.0);
  }
  const double wanted = count * std::pow(std::max(1.0, widest / options_.tolerance), 1.0 / rate);
  const double limit = options_.max_instances;
  // Of an interval without end nothing can be forecast; `wanted` is no number then.
  expected_ =
      wanted < limit ? std::min(limit, static_cast<double>(next_net_size(static_cast<int>(wanted) - 1))) : limit;
}

void EstimateForecast::report(double done) {
  if (!sink_) return;
  const double elapsed = watch_.seconds();
  const double total = std::max(done, expected_);
  double left = done > 0.0 ? elapsed * (total - done) / done : 0.0;
  double fraction = done / total;
  if (options_.max_seconds && *options_.max_seconds < elapsed + left) {
    left = std::max(0.0, *options_.max_seconds - elapsed);
    fraction = std::max(fraction, elapsed / (elapsed + left));
  }
  shown_ = std::clamp(fraction, shown_, 1.0);  // a bar never runs backwards
  sink_({shown_, left,
         std::to_string(static_cast<int>(done)) + " of about " + std::to_string(static_cast<int>(total)) +
             " instances" + settled_});
}

}  // namespace prescene::simulation
