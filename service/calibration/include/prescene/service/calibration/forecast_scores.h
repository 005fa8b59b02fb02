// SPDX-License-Identifier: Apache-2.0
// How good forecasts are: of one of several classes, and of a place in the plane.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

namespace prescene::service {

/// Sum over classes of (p - y)^2, y = 1 for the true class and 0 for the others: 0 for certainty that was right, 2 for
/// certainty that was wrong [Brier 1950].
double brier_score(std::span<const double> probabilities, int truth);
/// Natural logarithm of the true class's probability, which counts as at least `floor`.
double log_score(std::span<const double> probabilities, int truth, double floor = 1e-3);
/// Index of the largest probability (the first of equals).
int mode_of(std::span<const double> probabilities);

/// (count + prior) / (n + classes * prior): class probabilities from samples; with prior 1/2 no class is impossible.
std::vector<double> probabilities_of(std::span<const int> counts, double prior = 0.5);

/// A forecast of a place: samples, each a Gaussian with the covariance of the whole (Scott's rule) and a floor.
struct PlaneDensity {
  std::vector<Eigen::Vector2d> samples;
  Eigen::Matrix2d covariance;  ///< Of each kernel, m^2.
};
/// Kernel covariance (scale^2 n^(-1/3) times the mean covariance within the groups) + floor^2 identity. `groups[i]` is
/// the class of sample i: what lies between two classes is not smoothed over. samples.size() == groups.size() > 0.
PlaneDensity density_of(std::vector<Eigen::Vector2d> samples, std::span<const int> groups, double scale, double floor);
/// Mass of the highest-density region on whose border `place` lies: below c iff the place is inside the region of mass
/// c. By quadrature over points spread through each kernel, deterministic.
double region_mass(const PlaneDensity& density, const Eigen::Vector2d& place);

/// Mean distance of the samples to the place less half their mean distance to each other, m: proper, so that it is
/// least in expectation for the true distribution [Gneiting & Raftery 2007]. Not empty.
double energy_score(std::span<const Eigen::Vector2d> samples, const Eigen::Vector2d& place);

/// Value below which the share `q` of the values lies, by linear interpolation between the sorted ones. Not empty.
double quantile(std::vector<double> values, double q);

}  // namespace prescene::service
