// SPDX-License-Identifier: Apache-2.0
// The probability that two bodies touch from poses drawn: for errors that are too large for the first order, or that
// bring more spheres together than are kept.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "prescene/collision/spheres/relative_uncertainty.h"
#include "prescene/collision/spheres/uncertain_sphere_queries.h"
#include "uncertain_memory.h"

namespace prescene::collision {

/// Whether estimates of first order in the error are good where they miss so much of an error with that deviation (m):
/// up to turns of some 0.04 rad about an axis across the distance.
inline bool is_small_error(double missed, double deviation) { return missed <= 0.5 * deviation; }

/// `touches` says whether the bodies do at a given X_AB.
template <class Touches>
void estimate_by_draws(const RelativeUncertainty& between, const UncertainScratch::Memory& memory,
                       const Touches& touches, UncertainOverlap* overlap) {
  std::size_t touching = 0;
  for (const auto& z : memory.draws) touching += touches(between.displaced(z)) ? 1 : 0;
  const auto n = static_cast<double>(memory.draws.size());
  const auto k = static_cast<double>(touching);
  overlap->probability = std::clamp(k / n, overlap->lower, overlap->upper);
  // Never zero: what was not seen in n draws has less than 3 / n with 95 %.
  const double about = (k + 1.0) / (n + 2.0);
  overlap->probability_error = std::max(2.0 * std::sqrt(about * (1.0 - about) / n), 3.0 / n);
}

}  // namespace prescene::collision
