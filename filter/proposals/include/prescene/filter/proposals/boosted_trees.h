// SPDX-License-Identifier: Apache-2.0
// The log odds of a yes or no from a few numbers, as a sum of small decision trees that are learned from examples
// (gradient boosting of the logistic loss [Friedman 2001], second-order steps, histograms of each number).
//
//   BoostedTrees trees = fit_boosted_trees(values, 20, yes, {}, {});
//   double p = 1.0 / (1.0 + std::exp(-trees.log_odds(example)));
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace prescene::filter {

struct BoostedTrees {
  static constexpr int kDepth = 4;
  static constexpr int kSplits = (1 << kDepth) - 1;
  static constexpr int kLeaves = 1 << kDepth;

  /// A complete binary tree in the order of a heap: an example goes to the second child where its number is above the
  /// threshold. A split that tells nothing has an infinite threshold.
  struct Tree {
    std::array<std::uint16_t, kSplits> column{};
    std::array<float, kSplits> threshold{};
    std::array<float, kLeaves> leaf{};
    friend bool operator==(const Tree&, const Tree&) = default;
  };

  double bias = 0.0;  ///< Log odds without any tree.
  std::vector<Tree> trees;

  bool empty() const { return trees.empty(); }
  /// values.size() is that of the examples the trees were fitted to.
  double log_odds(std::span<const float> values) const;
  friend bool operator==(const BoostedTrees&, const BoostedTrees&) = default;
};

/// How trees are fitted. All chosen, not tuned on data.
struct Boosting {
  int trees = 120;     ///< Their number, >= 0.
  double rate = 0.08;  ///< Share of each tree's step that is taken, in (0, 1].
  /// >= 0. Added to a leaf's curvature, so that few examples say little: a leaf of 4 * shrinkage examples at even odds
  /// says half of what they do.
  double shrinkage = 8.0;
  /// >= 0. Curvature (a quarter of an example at even odds) that each side of a split needs.
  double least_weight = 4.0;
};

/// `values`: row by row, `columns` finite numbers an example; yes.size() examples, of `weights` (empty = all 1).
/// Without examples of both kinds there are no trees. The same bits on every run.
BoostedTrees fit_boosted_trees(std::span<const float> values, int columns, std::span<const std::uint8_t> yes,
                               std::span<const float> weights, const Boosting& options);

}  // namespace prescene::filter
