// SPDX-License-Identifier: Apache-2.0
// Shares of classes and their intervals.
#include <algorithm>
#include <cmath>

#include "prescene/core/check.h"
#include "prescene/core/random.h"
#include "prescene/simulation/outcomes/outcome_estimator.h"
#include "prescene/simulation/outcomes/quantiles.h"

namespace prescene::simulation {
namespace {

/// Fewest blocks that a net is cut into: 12 of 3 2^j points, so that nets of 2^k points make 16.
constexpr std::size_t kMinBlocks = 12;

struct ComponentShare {
  double share = 0.0;           ///< Of the class among the component's points.
  double block_variance = 0.0;  ///< Of the share, from the means of its blocks.
  double blocks = 0.0;
};

ComponentShare share_of(const std::vector<int>& classes, int which) {
  const std::size_t count = classes.size();
  std::size_t length = 1;
  while (count / (2 * length) >= kMinBlocks) length *= 2;
  const std::size_t blocks = count / length;  // points behind the last whole block only enter the share

  double total = 0.0, block_sum = 0.0, block_squares = 0.0, in_block = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    const double hit = classes[i] == which ? 1.0 : 0.0;
    total += hit;
    in_block += hit;
    if ((i + 1) % length == 0) {
      const double mean = in_block / static_cast<double>(length);
      block_sum += mean;
      block_squares += mean * mean;
      in_block = 0.0;
    }
  }
  ComponentShare result;
  result.share = total / static_cast<double>(count);
  result.blocks = static_cast<double>(blocks);
  if (blocks >= 2) {
    const double mean = block_sum / result.blocks;
    const double variance = std::max(0.0, block_squares - result.blocks * mean * mean) / (result.blocks - 1.0);
    result.block_variance = variance / result.blocks;
  }
  return result;
}

/// Below this share of its expectation a variance estimate of so many degrees of freedom falls once in twenty times
/// [Wilson & Hilferty 1931]. Taking the narrower interval without asking whether it is narrower by chance costs chaotic
/// problems 2 points of coverage.
double lower_variance_limit(double freedom) {
  const double spread = 2.0 / (9.0 * freedom);
  const double root = 1.0 - spread - 1.6448536269514722 * std::sqrt(spread);
  return root > 0.0 ? root * root * root : 0.0;
}

/// Jeffreys' interval of a class that held of all instances (or none), of `effective_count` equally weighted ones.
ClassEstimate jeffreys(bool all, double effective_count, double confidence) {
  const double reach = beta_quantile(0.5 + 0.5 * confidence, 0.5, effective_count + 0.5);
  ClassEstimate estimate;
  estimate.probability = all ? 1.0 : 0.0;
  estimate.low = all ? 1.0 - reach : 0.0;
  estimate.high = all ? 1.0 : reach;
  estimate.half_width = 0.5 * reach;
  return estimate;
}

}  // namespace

ClassEstimate class_estimate(std::span<const ComponentClasses> components, int which, double confidence) {
  double weight_sum = 0.0;
  for (const ComponentClasses& component : components)
    if (!component.classes.empty()) weight_sum += component.weight;
  PRESCENE_CHECK_MSG(weight_sum > 0.0, "a class estimate needs instances");

  double probability = 0.0, continuity = 0.0, wald = 0.0, blocks = 0.0, blocks_squares = 0.0, inverse_count = 0.0;
  double fewest_freedom = 1e300;
  bool replicated = true, none = true, all = true;
  for (const ComponentClasses& component : components) {
    if (component.classes.empty()) continue;
    const double weight = component.weight / weight_sum;
    const double count = static_cast<double>(component.classes.size());
    const ComponentShare share = share_of(component.classes, which);
    probability += weight * share.share;
    none = none && share.share == 0.0;
    all = all && share.share == 1.0;
    wald += weight * weight * share.share * (1.0 - share.share) / count;
    continuity += weight * weight / (4.0 * count * count);
    inverse_count += weight * weight / count;
    const double variance = weight * weight * share.block_variance;
    blocks += variance;
    if (share.blocks < 2.0) {
      replicated = false;
      continue;
    }
    blocks_squares += variance * variance / (share.blocks - 1.0);
    fewest_freedom = std::min(fewest_freedom, share.blocks - 1.0);
  }
  if (none || all) return jeffreys(all, 1.0 / inverse_count, confidence);

  const double upper = 0.5 + 0.5 * confidence;
  double half = core::inverse_normal_cdf(upper) * std::sqrt(wald + continuity);
  if (replicated) {
    const double freedom = blocks_squares > 0.0 ? blocks * blocks / blocks_squares : fewest_freedom;
    if (blocks < lower_variance_limit(freedom) * wald)
      half = std::min(half, student_t_quantile(upper, freedom) * std::sqrt(blocks + continuity));
  }
  ClassEstimate estimate;
  estimate.probability = probability;
  estimate.half_width = half;
  estimate.low = std::max(0.0, probability - half);
  estimate.high = std::min(1.0, probability + half);
  return estimate;
}

}  // namespace prescene::simulation
