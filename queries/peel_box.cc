// SPDX-License-Identifier: Apache-2.0
#include "peel_box.h"

#include <algorithm>
#include <cstddef>

namespace prescene::queries {
namespace {

bool is_in(const UnitPoint& at, const UnitPoint& low, const UnitPoint& high) {
  for (std::size_t k = 0; k < at.size(); ++k)
    if (at[k] < low[k] || at[k] > high[k]) return false;
  return true;
}

}  // namespace

void peel_box(const UnitPoint& centre, std::span<const BoxSample> samples, double wanted, UnitPoint& low,
              UnitPoint& high) {
  constexpr double kSlab = 0.1;
  constexpr int kMostSlabs = 60, kFewest = 24;
  for (int slab = 0; slab < kMostSlabs; ++slab) {
    int inside = 0, succeeded = 0;
    for (const BoxSample& sample : samples) {
      if (!is_in(sample.at, low, high)) continue;
      ++inside;
      succeeded += sample.succeeded;
    }
    if (inside < kFewest || succeeded >= wanted * inside) return;
    double best_gain = -1.0;
    std::size_t best_side = 0;
    double best_bound = 0.0;
    for (std::size_t side = 0; side < 2 * centre.size(); ++side) {
      const std::size_t k = side / 2;
      const bool lower = side % 2 == 0;
      const double way = kSlab * (high[k] - low[k]);
      const double bound = lower ? std::min(centre[k], low[k] + way) : std::max(centre[k], high[k] - way);
      int lost = 0, failures = 0;
      for (const BoxSample& sample : samples) {
        if (!is_in(sample.at, low, high) || (lower ? sample.at[k] >= bound : sample.at[k] <= bound)) continue;
        ++lost;
        failures += !sample.succeeded;
      }
      if (lost == 0 || failures == 0) continue;
      // Failures beyond those that a slab of its size would lose anyway.
      const double gain = failures - static_cast<double>(lost) * (inside - succeeded) / inside;
      if (gain <= best_gain) continue;
      best_gain = gain;
      best_side = side;
      best_bound = bound;
    }
    if (best_gain < 0.0) return;
    (best_side % 2 == 0 ? low : high)[best_side / 2] = best_bound;
  }
}

}  // namespace prescene::queries
