// SPDX-License-Identifier: Apache-2.0
#include "varied_parameters.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace prescene::simulation {
namespace {

// Of the prior, in its deviations: the search, which does not weigh it, stays within.
constexpr double kFarthest = 5.0;
// The mean of frictions before, times these, is where searches begin. Where friction is so large that all impacts grip,
// its value makes no difference, and nothing there says which way is better.
constexpr std::array kFrictionStarts = {1.0, 0.2, 2.0};
// Of the starts' noise, in that of the tracker. The one that is large is tried with the believed friction only: where
// little is simulated as it is in nature, a search from little noise may end where a scatter of friction stands for
// what is wrong. Not of slides alone: it would lift them off their support, so that they bounce.
constexpr double kNoiseStart = 3.0, kLargeNoiseStart = 30.0;

struct Range {
  double step;  // Half of the first one of the search.
  double low;
  double high;
};

Range range_of(MotionParameter parameter, double radius_of_gyration) {
  switch (parameter) {
    case MotionParameter::kFriction:
    case MotionParameter::kImpactFriction:
      return {0.02, 0.0, 3.0};
    case MotionParameter::kRestitution:
      return {0.03, 0.0, 0.98};
    case MotionParameter::kInertiaSize:
      return {0.06, -1.0, 1.0};
    case MotionParameter::kEdgeRadius:
      return {0.02 * radius_of_gyration, 0.0, 0.3 * radius_of_gyration};
    default:
      return {0.02 * radius_of_gyration, -2.0 * radius_of_gyration, 2.0 * radius_of_gyration};
  }
}

bool is_friction(std::size_t parameter) {
  return parameter == static_cast<std::size_t>(MotionParameter::kFriction) ||
         parameter == static_cast<std::size_t>(MotionParameter::kImpactFriction);
}

}  // namespace

VariedParameters::VariedParameters(const MotionPrior& prior, double radius_of_gyration) {
  for (std::size_t i = 0; i < kMotionParameters; ++i) {
    fixed_.values[i] = prior[i].mean;
    if (prior[i].deviation == 0.0) continue;
    const auto parameter = static_cast<MotionParameter>(i);
    const Range range = range_of(parameter, radius_of_gyration);
    free_.push_back(i);
    estimated_.push_back(
        {to_string(parameter), prior[i].mean, range.step, range.low, range.high, prior[i].mean, prior[i].deviation});
  }
}

std::vector<std::vector<SearchParameter>> VariedParameters::starts(bool any_flight) const {
  std::vector<SearchParameter> believed;
  for (const EstimatedParameter& p : estimated_) {
    const double start = std::clamp(p.prior_mean, p.low, p.high);
    const double far = kFarthest * p.prior_deviation;
    believed.push_back({p.name, start, std::min(2.0 * p.scale, p.prior_deviation), std::max(p.low, start - far),
                        std::min(p.high, start + far)});
  }
  MotionHypothesis unsure;
  unsure.start_noise = kNoiseStart;
  unsure.friction_scatter = 0.03;
  for (const SearchParameter& p : noise(unsure)) believed.push_back(p);

  std::vector<std::vector<SearchParameter>> all;
  for (const double factor : kFrictionStarts) {
    std::vector<SearchParameter> start = believed;
    bool elsewhere = factor == 1.0;
    for (std::size_t i = 0; i < free_.size(); ++i) {
      if (!is_friction(free_[i])) continue;
      const double value = start[i].value;
      start[i].value = std::clamp(factor * value, start[i].low, start[i].high);
      elsewhere = elsewhere || std::abs(start[i].value - value) > 2.0 * start[i].step;
    }
    if (elsewhere) all.push_back(std::move(start));
  }
  if (!any_flight) return all;
  unsure.start_noise = kLargeNoiseStart;
  std::vector<SearchParameter> noisy = all.front();
  std::ranges::copy(noise(unsure), noisy.begin() + static_cast<std::ptrdiff_t>(estimated_.size()));
  all.push_back(std::move(noisy));
  return all;
}

std::vector<SearchParameter> VariedParameters::noise(const MotionHypothesis& at) {
  return {{"start_noise", std::log(at.start_noise), 0.5, std::log(0.3), std::log(300.0)},
          {"friction_scatter", at.friction_scatter, 0.02, 0.0, 0.5}};
}

std::vector<EstimatedParameter> VariedParameters::estimated(const MotionHypothesis& at) const {
  std::vector<EstimatedParameter> all = estimated_;
  for (std::size_t i = 0; i < all.size(); ++i) {
    all[i].value = at.values[free_[i]];
    all[i].scale = 0.5 * std::min(all[i].scale, all[i].prior_deviation);
  }
  return all;
}

MotionHypothesis VariedParameters::with_parameters(MotionHypothesis hypothesis, std::span<const double> values) const {
  for (std::size_t i = 0; i < free_.size(); ++i) hypothesis.values[free_[i]] = values[i];
  return hypothesis;
}

MotionHypothesis VariedParameters::with_noise(MotionHypothesis hypothesis, std::span<const double> values) {
  hypothesis.start_noise = std::exp(values[0]);
  hypothesis.friction_scatter = values[1];
  return hypothesis;
}

MotionHypothesis VariedParameters::hypothesis_of(std::span<const double> values) const {
  return with_noise(with_parameters(fixed_, values), values.subspan(free_.size()));
}

}  // namespace prescene::simulation
