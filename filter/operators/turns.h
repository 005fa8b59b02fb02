// SPDX-License-Identifier: Apache-2.0
// Particles of about one turn, as one hypothesis.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "prescene/belief/belief.h"
#include "prescene/geometry/symmetry.h"

namespace prescene::filter {

/// Particles of about one turn, by the heaviest of them.
struct Turn {
  std::size_t leader;
  double log_before = -std::numeric_limits<double>::infinity();
  double log_after = -std::numeric_limits<double>::infinity();
};

/// For each particle the index of its turn, the heaviest particle's first. Adds to `turns`, which is empty.
std::vector<std::size_t> turns_of(const std::vector<belief::Particle>& particles,
                                  const geometry::SymmetryGroup& symmetry, std::vector<Turn>& turns);

/// ln(e^a + e^b).
inline double log_sum(double a, double b) {
  const double larger = std::max(a, b);
  if (!std::isfinite(larger)) return larger;
  return larger + std::log(std::exp(a - larger) + std::exp(b - larger));
}

}  // namespace prescene::filter
