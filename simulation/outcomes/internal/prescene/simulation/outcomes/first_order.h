// SPDX-License-Identifier: Apache-2.0
// How much of an outcome's variance one uncertain input explains alone: first-order shares (Sobol's indices) from the
// instances that there are [Saltelli et al. 2008, section 1.2.8; Plischke 2010].
//
//   InputEffect effect = first_order_effect(friction, classes, 3, weights);
//   ... effect.share                   // of the variance of the classes, in [0, 1]
//   ... effect.low_fifth[0]            // probability of class 0 where the friction is in its lowest fifth
#pragma once

#include <span>
#include <vector>

namespace prescene::simulation {

struct InputEffect {
  /// Var(E[class | input]) / Var(class), summed over the classes' indicators above and below the line, in [0, 1].
  double share = 0.0;
  /// From leaving out each of 16 blocks of the instances in turn, and from chance among the intervals (never 0 where
  /// the input varies); too large rather than too small for nets.
  double standard_error = 0.0;
  std::vector<double> low_fifth, high_fifth;  ///< Per class: its probability where the input is that small, that large.
};

/// `input` and `classes` are those of the instances in their order; weights need not sum to one; an instance of class
/// -1 is left out. The input is cut into 4 to 16 intervals of equal mass; what their means scatter by chance is taken
/// off. (What an input decides within an interval is missed: a few per cent of its share with 4.) An input that hardly
/// varies (fewer than two values) has no share. At least 16 instances, sizes alike (checked).
InputEffect first_order_effect(std::span<const double> input, std::span<const int> classes, int class_count,
                               std::span<const double> weights);

}  // namespace prescene::simulation
