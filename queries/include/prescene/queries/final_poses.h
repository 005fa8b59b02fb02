// SPDX-License-Identifier: Apache-2.0
// Where an object ends, as a density made of simulated instances: a Gaussian about each, narrow where many ended alike.
//
// Kernels are smoothed within one outcome, one resting face and one place only: h s_c n_c^(-1/6) wide on each axis, s_c
// being the spread and n_c the number of the instances that ended so [Scott 1992, section 6.3; bandwidth factor h = 0.6
// measured]. Places are separated by long empty stretches between them.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "prescene/belief/query.h"
#include "prescene/core/parallel.h"
#include "prescene/geometry/symmetry.h"

namespace prescene::queries {

/// Where one instance left the object.
struct FinalSample {
  belief::Pose X_WO;
  double weight = 0.0;  ///< Those of all samples sum to one.
  int outcome = 0;      ///< Index into the names given.
};

struct DensityOptions {
  double bandwidth = 0.6;  ///< h
  double cell = 0.02;      ///< Of the heat map, m; doubled until the map has at most max_cells on a side.
  int max_cells = 512;
  int max_components = 32;     ///< Merging goes on while there are more (never over outcomes or faces), ...
  double merge_below = 0.002;  ///< ...or while the cheapest merge costs less than this (nats) [Runnalls 2007].
  double min_weight = 1e-4;    ///< Lighter components are merged into the heaviest of the same outcome and face.
};

/// The Gaussian kernel of each sample, in order. Samples are first turned to their equivalents under the object's
/// symmetry that lie nearest to each other, so that a symmetric object's spread is not taken for uncertainty.
struct Kernel {
  belief::PoseComponent component;
  int group = 0;  ///< Same outcome and same face up: equal numbers.
};
std::vector<Kernel> kernels(std::span<const FinalSample> samples, std::span<const std::string> outcomes,
                            const geometry::SymmetryGroup& symmetry, const DensityOptions& options);

/// Exact mass of each cell under kernels whose position covariance is diagonal, as those of kernels() are.
belief::HeatMap heat_map(std::span<const Kernel> kernels, const DensityOptions& options);

/// All of it. At least one sample (checked).
belief::FinalPoses final_poses(const std::string& object, std::span<const FinalSample> samples,
                               std::span<const std::string> outcomes, const geometry::SymmetryGroup& symmetry,
                               const DensityOptions& options, core::ThreadPool& pool);

}  // namespace prescene::queries
