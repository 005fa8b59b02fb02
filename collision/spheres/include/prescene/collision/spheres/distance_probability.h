// SPDX-License-Identifier: Apache-2.0
// How probable it is that two points whose difference is Gaussian are no further apart than a given distance: what an
// uncertain sphere query asks of each pair of spheres.
//
//   const double p = distance_probability(p_CaCb, covariance, radius_a + radius_b);
//
// With x = mean + noise, |x|^2 is a weighted sum of noncentral chi-square variables. Lengths are in metres, but any
// unit does: only ratios count. Nothing here allocates.
#pragma once

#include <Eigen/Core>

namespace prescene::collision {

struct ProbabilityBounds {
  double lower = 0.0;
  double upper = 1.0;

  friend bool operator==(const ProbabilityBounds&, const ProbabilityBounds&) = default;
};

/// P(|x| <= radius) for x ~ N(mean, deviation^2 I) with |mean| = distance: closed form, exact to 1e-12. A deviation of
/// 0 answers 0 or 1 (1 at equality); a negative radius answers 0.
double isotropic_distance_probability(double distance, double deviation, double radius);

/// Bound of distance_probability's error; the largest found in 100,000 random and degenerate cases is 3e-4.
inline constexpr double kDistanceProbabilityError = 5e-4;

/// P(|x| <= radius) for x ~ N(mean, covariance), within kDistanceProbabilityError. The covariance is symmetric and
/// positive semidefinite of any rank, also zero (eigenvalues below 0 count as 0). The probability is the inverse
/// Laplace transform of |x|^2's moment generating function; it is integrated along a hyperbola through the saddle point
/// that follows the path of steepest descent [Rice 1980], by the trapezoidal rule with six points. Takes 0.8 us.
double distance_probability(const Eigen::Vector3d& mean, const Eigen::Matrix3d& covariance, double radius);

/// Bounds that hold without exception, in a quarter of the time. Upper: x's component along the mean alone, or each
/// coordinate alone, is within the radius. Lower: the component along the mean and the part across it are both small
/// enough.
ProbabilityBounds distance_probability_bounds(const Eigen::Vector3d& mean, const Eigen::Matrix3d& covariance,
                                              double radius);

/// P(X >= h and Y >= k) for standard normal X and Y with a correlation in [-1, 1], within 1e-6 [Drezner and
/// Wesolowsky 1990].
double joint_upper_tail(double h, double k, double correlation);

/// P(|z| >= radius) for six independent standard normal numbers, and its inverse in the radius (probability in (0, 1]).
double six_dimensional_tail(double radius);
double six_dimensional_radius(double probability);
/// The radius that three independent standard normal numbers exceed in length with a probability in (0, 1].
double three_dimensional_radius(double probability);

}  // namespace prescene::collision
