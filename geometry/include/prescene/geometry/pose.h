// SPDX-License-Identifier: Apache-2.0
// Rigid transforms and twists in monogram notation: X_WB is the pose of frame B in frame W, X_WB * X_BC = X_WC,
// X_WB * p_BQ = p_WQ; V_WB is the twist of B in W, expressed in W unless a suffix says otherwise.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <string>

namespace prescene::geometry {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// A rigid transform: unit quaternion (w, x, y, z in files) and translation in metres.
struct Pose {
  Quaterniond rotation = Quaterniond::Identity();
  Vector3d translation = Vector3d::Zero();

  static Pose identity() { return {}; }
  static Pose from_translation(const Vector3d& p) { return {Quaterniond::Identity(), p}; }
  /// From the upper 3x4 of a homogeneous matrix; the rotation block must be a rotation within 1e-3 (checked) and is
  /// made exactly orthonormal.
  static Pose from_matrix(const Eigen::Matrix4d& matrix);

  Eigen::Matrix4d matrix() const;
  Pose inverse() const;
  bool is_finite() const;

  friend bool operator==(const Pose& a, const Pose& b) {
    return a.rotation.coeffs() == b.rotation.coeffs() && a.translation == b.translation;
  }
};

/// X_AB * X_BC = X_AC. The product is not renormalised: see normalized().
Pose operator*(const Pose& X_AB, const Pose& X_BC);
/// X_AB * p_BQ = p_AQ.
Vector3d operator*(const Pose& X_AB, const Vector3d& p_BQ);
/// The same pose with an exactly unit quaternion whose w is >= 0.
Pose normalized(const Pose& X);

/// Angle of the rotation between two orientations, radians in [0, pi].
double angle_between(const Quaterniond& a, const Quaterniond& b);
/// exp of a rotation vector (radians).
Quaterniond exp_rotation(const Vector3d& rotation_vector);
/// Rotation vector (radians, norm <= pi) of a unit quaternion.
Vector3d log_rotation(const Quaterniond& rotation);

/// The matrix [v]x with [v]x u = v x u.
Matrix3d cross_matrix(const Vector3d& v);

/// Error coordinates of a pose about a mean, order (rotation, translation): rotation in the body frame,
/// R = R_mean * exp(d.head<3>()), translation in the parent frame, p = p_mean + d.tail<3>().
/// Covariances of poses (Matrix6d) are in these coordinates everywhere.
Pose box_plus(const Pose& X_mean, const Vector6d& d);
/// The d with box_plus(X_mean, d) == X.
Vector6d box_minus(const Pose& X, const Pose& X_mean);

/// Interpolation: slerp of the rotation, straight line of the translation; t in [0, 1].
Pose interpolate(const Pose& X_a, const Pose& X_b, double t);

/// Spatial velocity of a body frame, rad/s and m/s: of the frame's origin, expressed in the reference frame.
struct Twist {
  Vector3d angular = Vector3d::Zero();
  Vector3d linear = Vector3d::Zero();

  friend bool operator==(const Twist&, const Twist&) = default;
  bool is_finite() const { return angular.allFinite() && linear.allFinite(); }
};

/// The twist of a frame fixed to the same body whose origin is p_BoQ_W away (expressed like the twist): v + w x p.
Twist shifted(const Twist& V_WB, const Vector3d& p_BoQ_W);

/// "(x, y, z) m, [w, x, y, z]".
std::string to_string(const Pose& X);

}  // namespace prescene::geometry
