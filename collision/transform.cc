// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/transform.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <string>
#include "prescene/core/text.h"

namespace prescene::collision {
namespace {

// How far a quaternion's length, or a matrix from a rotation, may be off: what text files with four digits give.
constexpr double kRigidTolerance = 1e-3;

core::Status check(const geometry::Pose& X, const char* name) {
  if (!X.is_finite())
    return core::invalid_input(std::string(name) + " is not finite; check the pose that was given: " + to_string(X));
  const double length = X.rotation.norm();
  if (std::abs(length - 1.0) > kRigidTolerance) {
    return core::invalid_input(std::string(name) + " has a quaternion of length " + core::rounded_text(length) +
                               "; normalise it: scales are not rigid");
  }
  return core::ok_status();
}

core::Status check_translation(const Eigen::Vector3d& p) {
  if (p.cwiseAbs().maxCoeff() <= static_cast<double>(kLargestCoordinate)) return core::ok_status();
  return core::invalid_input("the bodies are " + core::rounded_text(p.norm()) +
                             " m apart; the limit is 1e9 m: check the unit of the poses");
}

}  // namespace

Eigen::Matrix3d rotation_matrix(const Transform& X_AB) {
  return Eigen::Map<const Eigen::Matrix<float, 3, 3, Eigen::RowMajor>>(X_AB.rotation.data()).cast<double>();
}

Eigen::Vector3d translation_vector(const Transform& X_AB) {
  return Eigen::Map<const Eigen::Vector3f>(X_AB.translation.data()).cast<double>();
}

Transform rounded_transform(const Eigen::Matrix3d& R_AB, const Eigen::Vector3d& p_AB) {
  Transform X_AB;
  for (int row = 0; row < 3; ++row) {
    for (int col = 0; col < 3; ++col)
      X_AB.rotation[static_cast<std::size_t>(3 * row + col)] = static_cast<float>(R_AB(row, col));
    X_AB.translation[static_cast<std::size_t>(row)] = static_cast<float>(p_AB[row]);
  }
  return X_AB;
}

Transform inverse(const Transform& X_AB) {
  const Eigen::Matrix3d R_BA = rotation_matrix(X_AB).transpose();
  return rounded_transform(R_BA, -(R_BA * translation_vector(X_AB)));
}

core::Result<Transform> relative_transform(const geometry::Pose& X_WA, const geometry::Pose& X_WB) {
  PRESCENE_RETURN_IF_ERROR(check(X_WA, "X_WA"));
  PRESCENE_RETURN_IF_ERROR(check(X_WB, "X_WB"));
  const Eigen::Matrix3d R_WA = X_WA.rotation.normalized().toRotationMatrix();
  const Eigen::Matrix3d R_WB = X_WB.rotation.normalized().toRotationMatrix();
  const Eigen::Vector3d p_AB = R_WA.transpose() * (X_WB.translation - X_WA.translation);
  PRESCENE_RETURN_IF_ERROR(check_translation(p_AB));
  return rounded_transform(R_WA.transpose() * R_WB, p_AB);
}

core::Result<Transform> to_transform(const geometry::Pose& X_AB) {
  PRESCENE_RETURN_IF_ERROR(check(X_AB, "X_AB"));
  PRESCENE_RETURN_IF_ERROR(check_translation(X_AB.translation));
  return rounded_transform(X_AB.rotation.normalized().toRotationMatrix(), X_AB.translation);
}

core::Result<Transform> to_transform(const Eigen::Matrix4d& X_AB) {
  if (!X_AB.allFinite()) return core::invalid_input("X_AB is not finite; check the matrix that was given");
  const Eigen::Matrix3d R_AB = X_AB.topLeftCorner<3, 3>();
  const double off = (R_AB * R_AB.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (off > kRigidTolerance || R_AB.determinant() < 0.0) {
    return core::invalid_input("the upper 3 x 3 of X_AB is not a rotation (off by " + core::rounded_text(off) +
                               (R_AB.determinant() < 0.0 ? ", and it mirrors" : "") +
                               "); only rigid transforms are allowed: apply scales to the mesh");
  }
  if ((X_AB.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() > kRigidTolerance)
    return core::invalid_input("the last row of X_AB is not (0, 0, 0, 1); only rigid transforms are allowed");
  return to_transform(geometry::Pose::from_matrix(X_AB));
}

}  // namespace prescene::collision
