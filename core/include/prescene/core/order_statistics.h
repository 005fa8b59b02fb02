// SPDX-License-Identifier: Apache-2.0
// Values by their place in the order of a sample.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace prescene::core {

/// The middle value; of an even number of values the upper of the two in the middle, 0 of none.
inline double upper_median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace prescene::core
