// SPDX-License-Identifier: Apache-2.0
// What is told of a set of measured values.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace prescene::benchmarks {

struct Summary {
  std::size_t n = 0;
  double mean = 0.0;
  double median = 0.0;
  double min = 0.0;
  double max = 0.0;
  double standard_deviation = 0.0;         ///< Of the sample (n - 1); 0 for one value.
  double median_absolute_deviation = 0.0;  ///< From the median, not scaled.
};

/// All zero for no values.
Summary summarize(std::span<const double> values);

/// The middle value, or the mean of the two in the middle; 0 for no values.
double median(std::vector<double> values);

/// Those within 1.5 interquartile ranges of the quartiles (linear between order statistics), in their order.
std::vector<double> without_outliers(std::span<const double> values);

/// exp of the mean logarithm; all values positive (checked). 1 for no values.
double geometric_mean(std::span<const double> values);

}  // namespace prescene::benchmarks
