// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/proposals/boosted_trees.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "prescene/core/check.h"

namespace prescene::filter {
namespace {

constexpr int kBins = 64;  // of each column, with about as many examples in each

/// The thresholds between the bins of each column, ascending.
std::vector<std::vector<float>> bin_edges(std::span<const float> values, std::size_t columns, std::size_t rows) {
  std::vector<std::vector<float>> edges(columns);
  std::vector<float> sorted(rows);
  for (std::size_t c = 0; c < columns; ++c) {
    for (std::size_t r = 0; r < rows; ++r) sorted[r] = values[r * columns + c];
    std::sort(sorted.begin(), sorted.end());
    for (std::size_t b = 1; b < kBins; ++b) {
      const float edge = sorted[b * rows / kBins];
      if (edge < sorted.back() && (edges[c].empty() || edge > edges[c].back())) edges[c].push_back(edge);
    }
  }
  return edges;
}

struct GradientSums {
  double gradient = 0.0, curvature = 0.0;
  void add(const GradientSums& other) { gradient += other.gradient, curvature += other.curvature; }
  double gain(double shrinkage) const { return gradient * gradient / (curvature + shrinkage); }
};

}  // namespace

double BoostedTrees::log_odds(std::span<const float> values) const {
  double sum = bias;
  for (const Tree& tree : trees) {
    int node = 0;
    for (int level = 0; level < kDepth; ++level) {
      const auto n = static_cast<std::size_t>(node);
      node = 2 * node + (values[tree.column[n]] > tree.threshold[n] ? 2 : 1);
    }
    sum += static_cast<double>(tree.leaf[static_cast<std::size_t>(node - kSplits)]);
  }
  return sum;
}

BoostedTrees fit_boosted_trees(std::span<const float> values, int columns, std::span<const std::uint8_t> yes,
                               std::span<const float> weights, const Boosting& options) {
  const std::size_t rows = yes.size(), width = static_cast<std::size_t>(columns);
  PRESCENE_CHECK(values.size() == rows * width && (weights.empty() || weights.size() == rows));
  const auto weight_of = [&](std::size_t r) { return weights.empty() ? 1.0 : static_cast<double>(weights[r]); };
  double positive = 0.0, total = 0.0;
  for (std::size_t r = 0; r < rows; ++r) positive += yes[r] != 0 ? weight_of(r) : 0.0, total += weight_of(r);
  BoostedTrees fitted;
  if (!(positive > 0.0) || !(positive < total)) return fitted;
  fitted.bias = std::log(positive / (total - positive));

  const std::vector<std::vector<float>> edges = bin_edges(values, width, rows);
  std::vector<std::uint8_t> bins(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::vector<float>& e = edges[i % width];
    bins[i] = static_cast<std::uint8_t>(std::lower_bound(e.begin(), e.end(), values[i]) - e.begin());
  }
  std::vector<double> odds(rows, fitted.bias);
  std::vector<GradientSums> each(rows);
  std::vector<int> node(rows);
  for (int t = 0; t < options.trees; ++t) {
    for (std::size_t r = 0; r < rows; ++r) {
      const double p = 1.0 / (1.0 + std::exp(-odds[r]));
      each[r] = {weight_of(r) * ((yes[r] != 0 ? 1.0 : 0.0) - p), weight_of(r) * p * (1.0 - p)};
    }
    BoostedTrees::Tree tree;
    std::fill(node.begin(), node.end(), 0);
    for (int level = 0; level < BoostedTrees::kDepth; ++level) {
      const std::size_t first = (std::size_t{1} << level) - 1, count = std::size_t{1} << level;
      std::vector<GradientSums> histogram(count * width * kBins);
      for (std::size_t r = 0; r < rows; ++r) {
        const std::size_t base = (static_cast<std::size_t>(node[r]) - first) * width * kBins;
        for (std::size_t c = 0; c < width; ++c) histogram[base + c * kBins + bins[r * width + c]].add(each[r]);
      }
      for (std::size_t n = 0; n < count; ++n) {
        const GradientSums* mine = &histogram[n * width * kBins];
        GradientSums all;
        for (std::size_t b = 0; b < kBins; ++b) all.add(mine[b]);
        double best = 1e-6;
        std::uint16_t column = 0;
        float threshold = std::numeric_limits<float>::infinity();
        for (std::size_t c = 0; c < width; ++c) {
          GradientSums left;
          for (std::size_t b = 0; b < edges[c].size(); ++b) {
            left.add(mine[c * kBins + b]);
            const GradientSums right{all.gradient - left.gradient, all.curvature - left.curvature};
            if (left.curvature < options.least_weight || right.curvature < options.least_weight) continue;
            const double gain =
                left.gain(options.shrinkage) + right.gain(options.shrinkage) - all.gain(options.shrinkage);
            if (gain > best) best = gain, column = static_cast<std::uint16_t>(c), threshold = edges[c][b];
          }
        }
        tree.column[first + n] = column;
        tree.threshold[first + n] = threshold;
      }
      for (std::size_t r = 0; r < rows; ++r) {
        const auto n = static_cast<std::size_t>(node[r]);
        node[r] = 2 * node[r] + (values[r * width + tree.column[n]] > tree.threshold[n] ? 2 : 1);
      }
    }
    std::array<GradientSums, BoostedTrees::kLeaves> leaves{};
    for (std::size_t r = 0; r < rows; ++r)
      leaves[static_cast<std::size_t>(node[r] - BoostedTrees::kSplits)].add(each[r]);
    for (std::size_t l = 0; l < leaves.size(); ++l)
      tree.leaf[l] = static_cast<float>(options.rate * leaves[l].gradient / (leaves[l].curvature + options.shrinkage));
    for (std::size_t r = 0; r < rows; ++r)
      odds[r] += static_cast<double>(tree.leaf[static_cast<std::size_t>(node[r] - BoostedTrees::kSplits)]);
    fitted.trees.push_back(tree);
  }
  return fitted;
}

}  // namespace prescene::filter
