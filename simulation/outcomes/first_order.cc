// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/outcomes/first_order.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "prescene/core/check.h"

namespace prescene::simulation {
namespace {

constexpr int kBlocks = 16;

/// Intervals of the input. In a short net two coordinates may go together: unless there are several instances for every
/// pair of intervals of two inputs, one takes the other's effect for its own.
int interval_count(std::size_t instances) { return instances < 512 ? 4 : instances < 2048 ? 8 : 16; }

/// Sums of one interval of the input in one block of the instances.
struct Cell {
  double weight = 0.0, squares = 0.0;
  std::vector<double> of_class;
};

/// Variance of the interval means over that of the classes.
double share_of(const std::vector<Cell>& intervals) {
  const std::size_t classes = intervals.front().of_class.size();
  double weight = 0.0;
  std::vector<double> mean(classes, 0.0);
  for (const Cell& cell : intervals) {
    weight += cell.weight;
    for (std::size_t c = 0; c < classes; ++c) mean[c] += cell.of_class[c];
  }
  if (!(weight > 0.0)) return 0.0;
  double total = 0.0, between = 0.0;
  for (std::size_t c = 0; c < classes; ++c) {
    mean[c] /= weight;
    total += mean[c] * (1.0 - mean[c]);
    for (const Cell& cell : intervals) {
      if (!(cell.weight > 0.0)) continue;
      const double here = cell.of_class[c] / cell.weight;
      // The mean of n draws scatters by p (1 - p) / n; that of a sample is p (1 - p) (1 - 1/n) on average.
      const double count = cell.weight * cell.weight / cell.squares;
      const double chance = count > 1.0 ? here * (1.0 - here) / (count - 1.0) : 0.25;
      between += cell.weight / weight * ((here - mean[c]) * (here - mean[c]) - chance);
    }
  }
  return total > 0.0 ? between / total : 0.0;
}

void add(const Cell& cell, double sign, Cell& to) {
  to.weight += sign * cell.weight;
  to.squares += sign * cell.squares;
  for (std::size_t c = 0; c < cell.of_class.size(); ++c) to.of_class[c] += sign * cell.of_class[c];
}

/// Where each instance's input stands among all, in (0, 1): the mass below it and half of what is equal.
std::vector<double> ranks_of(std::span<const double> input, std::span<const double> weights) {
  std::vector<std::size_t> order(input.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return input[a] < input[b]; });
  const double sum = std::accumulate(weights.begin(), weights.end(), 0.0);
  std::vector<double> ranks(input.size());
  double below = 0.0;
  for (std::size_t begin = 0; begin < order.size();) {
    std::size_t end = begin;
    double equal = 0.0;
    while (end < order.size() && input[order[end]] == input[order[begin]]) equal += weights[order[end++]];
    for (std::size_t i = begin; i < end; ++i) ranks[order[i]] = (below + 0.5 * equal) / sum;
    below += equal;
    begin = end;
  }
  return ranks;
}

std::vector<double> class_means(const std::vector<double>& ranks, std::span<const int> classes,
                                std::span<const double> weights, int class_count, double low, double high) {
  std::vector<double> means(static_cast<std::size_t>(class_count), 0.0);
  double sum = 0.0;
  for (std::size_t i = 0; i < ranks.size(); ++i) {
    if (classes[i] < 0 || ranks[i] < low || ranks[i] > high) continue;
    sum += weights[i];
    means[static_cast<std::size_t>(classes[i])] += weights[i];
  }
  if (sum > 0.0)
    for (double& mean : means) mean /= sum;
  return means;
}

}  // namespace

InputEffect first_order_effect(std::span<const double> input, std::span<const int> classes, int class_count,
                               std::span<const double> weights) {
  PRESCENE_CHECK(input.size() == classes.size() && input.size() == weights.size() && class_count > 0);
  PRESCENE_CHECK(input.size() >= kBlocks);
  const auto count = static_cast<std::size_t>(interval_count(input.size()));
  const std::vector<double> ranks = ranks_of(input, weights);

  const Cell empty{0.0, 0.0, std::vector<double>(static_cast<std::size_t>(class_count), 0.0)};
  std::vector<std::vector<Cell>> blocks(kBlocks, std::vector<Cell>(count, empty));
  std::vector<Cell> all(count, empty);
  for (std::size_t i = 0; i < input.size(); ++i) {
    if (classes[i] < 0) continue;
    const std::size_t block = i * kBlocks / input.size();
    const auto place = std::min(count - 1, static_cast<std::size_t>(ranks[i] * static_cast<double>(count)));
    Cell& cell = blocks[block][place];
    cell.weight += weights[i];
    cell.squares += weights[i] * weights[i];
    cell.of_class[static_cast<std::size_t>(classes[i])] += weights[i];
  }
  for (const std::vector<Cell>& block : blocks)
    for (std::size_t k = 0; k < count; ++k) add(block[k], 1.0, all[k]);

  InputEffect effect;
  effect.low_fifth = class_means(ranks, classes, weights, class_count, 0.0, 0.2);
  effect.high_fifth = class_means(ranks, classes, weights, class_count, 0.8, 1.0);
  const bool varies = std::any_of(input.begin(), input.end(), [&](double value) { return value != input.front(); });
  if (!varies) {
    effect.low_fifth = effect.high_fifth = class_means(ranks, classes, weights, class_count, 0.0, 1.0);
    return effect;
  }
  std::vector<double> without;
  for (const std::vector<Cell>& block : blocks) {
    std::vector<Cell> rest = all;
    for (std::size_t k = 0; k < count; ++k) add(block[k], -1.0, rest[k]);
    without.push_back(share_of(rest));
  }
  const double mean = std::accumulate(without.begin(), without.end(), 0.0) / kBlocks;
  double squares = 0.0;
  for (double one : without) squares += (one - mean) * (one - mean);
  effect.share = std::clamp(share_of(all), 0.0, 1.0);
  // Blocks that agree to the last (a share of nothing or of all) do not make it certain: the chance that is taken off
  // scatters by itself, as chi squared with one degree of freedom less than intervals.
  double weight = 0.0, weight_squares = 0.0;
  for (const Cell& cell : all) {
    weight += cell.weight;
    weight_squares += cell.squares;
  }
  const double by_chance =
      weight > 0.0 ? std::sqrt(2.0 * (static_cast<double>(count) - 1.0)) * weight_squares / (weight * weight) : 1.0;
  effect.standard_error = std::hypot(std::sqrt(squares * (kBlocks - 1.0) / kBlocks), by_chance);
  return effect;
}

}  // namespace prescene::simulation
