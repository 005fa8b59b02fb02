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

/// Below this share of its expectation a variance estimate of so many degrees of freedom falls with the probability
/// that a standard normal number is above `deviate` [Wilson & Hilferty 1931].
double lower_variance_limit(double freedom, double deviate) {
  const double spread = 2.0 / (9.0 * freedom);
  const double root = 1.0 - spread - deviate * std::sqrt(spread);
  return root > 0.0 ? root * root * root : 0.0;
}
/// Exceeded once in twenty times. Taking the narrower interval without asking whether it is narrower by chance costs
/// chaotic problems 2 points of coverage.
constexpr double kOnceInTwenty = 1.6448536269514722;

/// Of a class over all components, with the variances of its share.
struct TotalShare {
  double probability = 0.0;
  double wald = 0.0;           ///< Variance of independent draws,
  double blocks = 0.0;         ///< and from the means of blocks, with
  double freedom = 0.0;        ///< so many degrees of freedom.
  double continuity = 0.0;     ///< To be added to either.
  double inverse_count = 0.0;  ///< Of equally weighted instances.
  bool replicated = true;      ///< There are blocks.
  bool none = true, all = true;

  /// Whether the net scatters less than independent draws, and not by chance.
  bool net_is_better(double deviate) const {
    return replicated && blocks < lower_variance_limit(freedom, deviate) * wald;
  }
};

TotalShare total_share(std::span<const ComponentClasses> components, int which) {
  double weight_sum = 0.0;
  for (const ComponentClasses& component : components)
    if (!component.classes.empty()) weight_sum += component.weight;
  PRESCENE_CHECK_MSG(weight_sum > 0.0, "a class estimate needs instances");

  TotalShare total;
  double blocks_squares = 0.0, fewest_freedom = 1e300;
  for (const ComponentClasses& component : components) {
    if (component.classes.empty()) continue;
    const double weight = component.weight / weight_sum;
    const double count = static_cast<double>(component.classes.size());
    const ComponentShare share = share_of(component.classes, which);
    total.probability += weight * share.share;
    total.none = total.none && share.share == 0.0;
    total.all = total.all && share.share == 1.0;
    total.wald += weight * weight * share.share * (1.0 - share.share) / count;
    total.continuity += weight * weight / (4.0 * count * count);
    total.inverse_count += weight * weight / count;
    const double variance = weight * weight * share.block_variance;
    total.blocks += variance;
    if (share.blocks < 2.0) {
      total.replicated = false;
      continue;
    }
    blocks_squares += variance * variance / (share.blocks - 1.0);
    fewest_freedom = std::min(fewest_freedom, share.blocks - 1.0);
  }
  total.freedom = blocks_squares > 0.0 ? total.blocks * total.blocks / blocks_squares : fewest_freedom;
  return total;
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

ClassEstimate estimate_of(const TotalShare& total, double confidence) {
  if (total.none || total.all) return jeffreys(total.all, 1.0 / total.inverse_count, confidence);
  const double upper = 0.5 + 0.5 * confidence;
  double half = core::inverse_normal_cdf(upper) * std::sqrt(total.wald + total.continuity);
  if (total.net_is_better(kOnceInTwenty))
    half = std::min(half, student_t_quantile(upper, total.freedom) * std::sqrt(total.blocks + total.continuity));
  ClassEstimate estimate;
  estimate.probability = total.probability;
  estimate.half_width = half;
  estimate.low = std::max(0.0, total.probability - half);
  estimate.high = std::min(1.0, total.probability + half);
  return estimate;
}

/// The lesser of `most` and the x with beta_cdf(x, a, b) == tail.
double lesser_beta_quantile(double most, double tail, double a, double b) {
  return beta_cdf(most, a, b) <= tail ? most : beta_quantile(tail, a, b);
}

}  // namespace

ClassEstimate class_estimate(std::span<const ComponentClasses> components, int which, double confidence) {
  return estimate_of(total_share(components, which), confidence);
}

ClassEstimate look_estimate(std::span<const ComponentClasses> components, int which, double confidence) {
  const TotalShare total = total_share(components, which);
  ClassEstimate estimate = estimate_of(total, confidence);
  const double error = 1.0 - confidence, p = estimate.probability;
  double count = 1.0 / total.inverse_count;
  // The net is trusted to be better only where chance would say so less often than the interval may miss.
  if (!total.none && !total.all && total.net_is_better(-core::inverse_normal_cdf(error))) {
    const double ratio =
        core::inverse_normal_cdf(1.0 - 0.5 * error) / student_t_quantile(1.0 - 0.5 * error, total.freedom);
    count = std::max(count, ratio * ratio * p * (1.0 - p) / (total.blocks + total.continuity));
  }
  const double hits = count * p, others = count - hits;
  if (estimate.low > 0.0) estimate.low = lesser_beta_quantile(estimate.low, 0.5 * error, hits, others + 1.0);
  if (estimate.high < 1.0)
    estimate.high = 1.0 - lesser_beta_quantile(1.0 - estimate.high, 0.5 * error, others, hits + 1.0);
  estimate.half_width = std::max({estimate.half_width, p - estimate.low, estimate.high - p});
  return estimate;
}

}  // namespace prescene::simulation
