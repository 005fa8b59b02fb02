// SPDX-License-Identifier: Apache-2.0
// Operator 5, resample (the paper calls it belief filtering): systematic resampling when the weights have become
// uneven, keeping the best particle as it is and spreading the copies of the others so that the mixture's moments stay.
#pragma once

#include <vector>

#include "prescene/belief/belief.h"
#include "prescene/core/random.h"

namespace prescene::filter {

struct ResampleOptions {
  /// share. The particles are resampled when their effective sample size is below this share of their number. Range 0
  /// to 1. Chosen.
  double min_effective_share = 0.5;
  /// share. Copies are drawn with this share of their particle's Gaussian and keep the rest as their covariance: with 0
  /// they are equal, with 1 they are points. Range 0 to 1. Chosen.
  double spread = 0.4;
};

/// Returns whether it resampled; then all weights are equal but that the best particle, unmoved, is first. Weights must
/// be normalised. Systematic resampling [Kitagawa 1996], one uniform draw. `sources`: the index before, of each
/// particle after; null = not wanted.
bool resample(const ResampleOptions& options, core::RandomStream stream, std::vector<belief::Particle>& particles,
              std::vector<std::size_t>* sources = nullptr);

/// What resample() makes of particles from these sources, but for their weights: copies of what does not rest are
/// spread. The first is the best, and stays where it is.
void copy_from(const ResampleOptions& options, core::RandomStream stream, const std::vector<std::size_t>& sources,
               std::vector<belief::Particle>& particles);

/// Indices of the particles chosen by systematic resampling from normalised weights, ascending, as many as there are
/// particles; `u` in (0, 1).
std::vector<int> systematic_indices(const std::vector<belief::Particle>& particles, double u);

}  // namespace prescene::filter
