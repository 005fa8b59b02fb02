// SPDX-License-Identifier: Apache-2.0
// Intervals of a probability from independent draws: one for a number of draws that was fixed beforehand, and one that
// may be looked at after every draw.
//
//   const PriorOfShare near_one{20.0, 0.5};
//   const ShareInterval now = confidence_sequence(successes, draws, 0.05, near_one);
//   if (now.low >= 0.95) ... now.low      // draw on, or stop at any time
#pragma once

#include <limits>
#include <span>

namespace prescene::queries {

struct ShareInterval {
  double low = 0.0;
  double high = 1.0;
};

/// The Beta distribution that a confidence sequence mixes over. It decides where the sequence is narrow, never whether
/// it is right; a, b > 0.
struct PriorOfShare {
  double a = 0.5;
  double b = 0.5;
};

/// Holds the true probability at all numbers of draws together with probability 1 - error at least, so that whoever
/// stops when they like what they see is not deceived: the shares p against which the mixture of likelihood ratios is
/// below 1 / error, B(a + s, b + f) / (B(a, b) p^s (1 - p)^f) < 1 / error [Robbins 1970; Ville 1939].
/// 0 <= successes <= draws, error in (0, 1).
ShareInterval confidence_sequence(int successes, int draws, double error, const PriorOfShare& prior);

/// The interval of Clopper and Pearson [1934] for a number of draws that was fixed before the first.
ShareInterval clopper_pearson(int successes, int draws, double error);

struct QuantileInterval {
  double value = 0.0;                                     ///< The least draw that at least that share does not exceed.
  double low = -std::numeric_limits<double>::infinity();  ///< Infinite: so few draws say nothing of that side.
  double high = std::numeric_limits<double>::infinity();
};
/// Of the quantile at `share`, in (0, 1), from independent draws in ascending order, at least one: the draws between
/// which it lies with probability 1 - error, whatever their distribution [Scheffe and Tukey 1945].
QuantileInterval quantile_interval(std::span<const double> sorted, double share, double error);

}  // namespace prescene::queries
