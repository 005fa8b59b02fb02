// SPDX-License-Identifier: Apache-2.0
// A number, vector, pose or twist that is known exactly or only as a distribution, and how to draw it from uniforms.
//
// Every distribution is drawn from uniform numbers in (0, 1), given as a span, so that the same code serves random
// streams and Sobol points; dimensions() says how many it takes. Coordinates that can't vary take none.
#pragma once

#include <limits>
#include <span>
#include <variant>
#include <vector>

#include "prescene/geometry/pose.h"

namespace prescene::belief {

using geometry::Matrix6d;
using geometry::Pose;
using geometry::Twist;
using geometry::Vector3d;
using geometry::Vector6d;

/// Exactly `value`.
struct FixedScalar {
  double value = 0.0;
  friend bool operator==(const FixedScalar&, const FixedScalar&) = default;
};
/// Normal, cut to [low, high] (draws are mapped through the truncated distribution function, nothing is clamped).
struct NormalScalar {
  double mean = 0.0;
  double standard_deviation = 0.0;  ///< >= 0
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  friend bool operator==(const NormalScalar&, const NormalScalar&) = default;
};
struct UniformScalar {
  double low = 0.0;
  double high = 0.0;  ///< >= low
  friend bool operator==(const UniformScalar&, const UniformScalar&) = default;
};
struct SampledScalar {
  std::vector<double> samples;  ///< Not empty, equally likely.
  friend bool operator==(const SampledScalar&, const SampledScalar&) = default;
};
using ScalarDistribution = std::variant<FixedScalar, NormalScalar, UniformScalar, SampledScalar>;

int dimensions(const ScalarDistribution& distribution);
double draw(const ScalarDistribution& distribution, std::span<const double> uniforms);
double mean(const ScalarDistribution& distribution);
double variance(const ScalarDistribution& distribution);
/// The ends of what can be drawn; infinite for a normal that is not cut.
double lowest(const ScalarDistribution& distribution);
double highest(const ScalarDistribution& distribution);

/// Three independent coordinates.
struct Vector3Distribution {
  ScalarDistribution x, y, z;
  static Vector3Distribution fixed(const Vector3d& value);
  friend bool operator==(const Vector3Distribution&, const Vector3Distribution&) = default;
};
int dimensions(const Vector3Distribution& distribution);
Vector3d draw(const Vector3Distribution& distribution, std::span<const double> uniforms);
Vector3d mean(const Vector3Distribution& distribution);
/// Of each coordinate.
Vector3d variance(const Vector3Distribution& distribution);

/// Exactly this pose.
struct FixedPose {
  Pose X_WO;
  friend bool operator==(const FixedPose&, const FixedPose&) = default;
};
/// box_plus(mean, d), d ~ N(0, covariance); order (rotation in O, translation in W), radians and metres.
struct NormalPose {
  Pose mean;
  Matrix6d covariance = Matrix6d::Zero();
  friend bool operator==(const NormalPose&, const NormalPose&) = default;
};
/// Independent position coordinates and a rotation that is `rotation` (times a uniform rotation if `any_rotation`).
struct BoxPose {
  Vector3Distribution position;
  geometry::Quaterniond rotation = geometry::Quaterniond::Identity();
  bool any_rotation = false;
  friend bool operator==(const BoxPose& a, const BoxPose& b) {
    return a.position == b.position && a.rotation.coeffs() == b.rotation.coeffs() && a.any_rotation == b.any_rotation;
  }
};
struct SampledPose {
  std::vector<Pose> samples;  ///< Not empty, equally likely.
  friend bool operator==(const SampledPose&, const SampledPose&) = default;
};
using PoseDistribution = std::variant<FixedPose, NormalPose, BoxPose, SampledPose>;

int dimensions(const PoseDistribution& distribution);
Pose draw(const PoseDistribution& distribution, std::span<const double> uniforms);
/// A column of the square root of a covariance for each dimension of `covariance`'s rank, widest first: the columns
/// that a normal distribution is drawn with, L L^T = covariance. Symmetric, positive semidefinite within rounding.
Eigen::MatrixXd covariance_square_root(const Eigen::MatrixXd& covariance);
/// The mean pose; of samples the one that minimises the sum of squared rotation angles, with the mean position.
Pose mean(const PoseDistribution& distribution);
/// Covariance about mean(distribution), in the coordinates of geometry::box_plus.
Matrix6d covariance(const PoseDistribution& distribution);

struct TwistDistribution {
  Vector3Distribution angular = Vector3Distribution::fixed(Vector3d::Zero());  ///< rad/s, in W
  Vector3Distribution linear = Vector3Distribution::fixed(Vector3d::Zero());   ///< m/s, of O's origin, in W
  friend bool operator==(const TwistDistribution&, const TwistDistribution&) = default;
};
int dimensions(const TwistDistribution& distribution);
Twist draw(const TwistDistribution& distribution, std::span<const double> uniforms);
Twist mean(const TwistDistribution& distribution);
/// Covariance about the mean, order (angular, linear).
Matrix6d covariance(const TwistDistribution& distribution);

}  // namespace prescene::belief
