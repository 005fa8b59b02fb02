// SPDX-License-Identifier: Apache-2.0
// How searches keep to their bounds.
#pragma once

#include <cmath>

namespace prescene::simulation {

/// What is beyond an end of [low, high] is as far inside.
inline double reflected(double value, double low, double high) {
  if (!(high > low)) return low;
  const double width = high - low;
  const double along = std::fmod(std::abs(value - low), 2.0 * width);
  return low + (along > width ? 2.0 * width - along : along);
}

}  // namespace prescene::simulation
