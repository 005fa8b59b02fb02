// SPDX-License-Identifier: Apache-2.0
#include "prescene/geometry/pose.h"

#include <Eigen/LU>
#include <cmath>
#include <cstdio>

#include "prescene/core/check.h"

namespace prescene::geometry {

Pose Pose::from_matrix(const Eigen::Matrix4d& matrix) {
  Matrix3d R = matrix.topLeftCorner<3, 3>();
  PRESCENE_CHECK_MSG((R.transpose() * R - Matrix3d::Identity()).cwiseAbs().maxCoeff() < 1e-3 && R.determinant() > 0.0,
                     "the upper left 3x3 block is no rotation");
  // Newton's iteration to the nearest rotation [Higham 1986]: it converges quadratically, from 1e-3 three steps are
  // enough.
  for (int i = 0; i < 4; ++i) R = 0.5 * (R + Matrix3d(R.inverse().transpose()));
  Pose X;
  X.rotation = Quaterniond(R).normalized();
  X.translation = matrix.topRightCorner<3, 1>();
  return X;
}

Eigen::Matrix4d Pose::matrix() const {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = rotation.toRotationMatrix();
  m.topRightCorner<3, 1>() = translation;
  return m;
}

Pose Pose::inverse() const {
  const Quaterniond back = rotation.conjugate();
  return {back, -(back * translation)};
}

Matrix3d cross_matrix(const Vector3d& v) {
  Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

bool Pose::is_finite() const { return rotation.coeffs().allFinite() && translation.allFinite(); }

Pose operator*(const Pose& X_AB, const Pose& X_BC) {
  return {X_AB.rotation * X_BC.rotation, X_AB.translation + X_AB.rotation * X_BC.translation};
}

Vector3d operator*(const Pose& X_AB, const Vector3d& p_BQ) { return X_AB.translation + X_AB.rotation * p_BQ; }

Pose normalized(const Pose& X) {
  Quaterniond q = X.rotation.normalized();
  if (q.w() < 0.0) q.coeffs() = -q.coeffs();
  return {q, X.translation};
}

double angle_between(const Quaterniond& a, const Quaterniond& b) { return log_rotation(a.conjugate() * b).norm(); }

Quaterniond exp_rotation(const Vector3d& rotation_vector) {
  const double angle_squared = rotation_vector.squaredNorm();
  Quaterniond q;
  if (angle_squared < 1e-6) {
    // The series of cos(angle / 2) and sin(angle / 2) / angle; what is left out is below 1e-20.
    q.w() = 1.0 - angle_squared / 8.0 + angle_squared * angle_squared / 384.0;
    q.vec() = (0.5 - angle_squared / 48.0 + angle_squared * angle_squared / 3840.0) * rotation_vector;
  } else {
    const double angle = std::sqrt(angle_squared);
    q.w() = std::cos(0.5 * angle);
    q.vec() = (std::sin(0.5 * angle) / angle) * rotation_vector;
  }
  return q;
}

Vector3d log_rotation(const Quaterniond& rotation) {
  // q and -q are the same rotation: the one with w >= 0 has the angle in [0, pi].
  const double sign = rotation.w() < 0.0 ? -1.0 : 1.0;
  const double w = sign * rotation.w();
  const double sine = rotation.vec().norm();
  if (sine < 1e-9) return (2.0 * sign / w) * rotation.vec();
  return (2.0 * sign * std::atan2(sine, w) / sine) * rotation.vec();
}

Pose box_plus(const Pose& X_mean, const Vector6d& d) {
  return {(X_mean.rotation * exp_rotation(d.head<3>())).normalized(), X_mean.translation + d.tail<3>()};
}

Vector6d box_minus(const Pose& X, const Pose& X_mean) {
  Vector6d d;
  d.head<3>() = log_rotation(X_mean.rotation.conjugate() * X.rotation);
  d.tail<3>() = X.translation - X_mean.translation;
  return d;
}

Pose interpolate(const Pose& X_a, const Pose& X_b, double t) {
  const Vector3d turn = log_rotation(X_a.rotation.conjugate() * X_b.rotation);
  return {(X_a.rotation * exp_rotation(t * turn)).normalized(), (1.0 - t) * X_a.translation + t * X_b.translation};
}

Twist shifted(const Twist& V_WB, const Vector3d& p_BoQ_W) {
  return {V_WB.angular, V_WB.linear + V_WB.angular.cross(p_BoQ_W)};
}

std::string to_string(const Pose& X) {
  char text[256];
  std::snprintf(text, sizeof text, "(%.6g, %.6g, %.6g) m, [%.6g, %.6g, %.6g, %.6g]", X.translation.x(),
                X.translation.y(), X.translation.z(), X.rotation.w(), X.rotation.x(), X.rotation.y(), X.rotation.z());
  return text;
}

}  // namespace prescene::geometry
