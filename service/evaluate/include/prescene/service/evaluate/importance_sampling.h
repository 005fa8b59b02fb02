// SPDX-License-Identifier: Apache-2.0
// Samples of a density over six numbers that can only be evaluated: importance sampling from a Student distribution
// that is fitted to the samples a few times [Cappe et al. 2004].
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "prescene/core/random.h"
#include "prescene/geometry/pose.h"

namespace prescene::service {

struct ImportanceOptions {
  int rounds = 8;             ///< In which the proposal is fitted, >= 0, ...
  int samples_a_round = 400;  ///< ... to so many samples each, > 0.
  int samples = 2500;         ///< From the last proposal, > 0.
  double widening = 1.25;     ///< Of the fitted standard deviations, so that tails are reached.
};

/// Centre and covariance of the Student proposal. With its 6 degrees of freedom, draws have 1.5 times this covariance.
struct ImportanceProposal {
  geometry::Vector6d mean = geometry::Vector6d::Zero();
  geometry::Matrix6d covariance = geometry::Matrix6d::Identity();  ///< Positive definite (not checked).
};

struct ImportanceSamples {
  std::vector<geometry::Vector6d> points;
  std::vector<double> log_densities;  ///< Of the target, up to one constant.
  std::vector<double> weights;        ///< Sum to 1.
  ImportanceProposal fitted;          ///< Mean and covariance of the samples.
  double effective = 0.0;             ///< Effective number of samples, 1 / sum of squared weights.

  /// The share of the distribution that is denser than `log_density`: the smallest region of highest density that
  /// holds a point of that density holds so much.
  double mass_above(double log_density) const;
};

/// Fills `log_densities[i]` of points[i], up to one constant. -inf where the density is zero; not NaN or +inf. Called
/// on the caller's thread, once a round with all of its points.
using LogDensity = std::function<void(std::span<const geometry::Vector6d> points, std::span<double> log_densities)>;

/// In each round at least one point must have a density above zero (not checked): weights are NaN otherwise. The same
/// stream gives the same samples.
ImportanceSamples sample_by_importance(const LogDensity& target, const ImportanceProposal& start,
                                       const ImportanceOptions& options, core::RandomStream& stream);

}  // namespace prescene::service
