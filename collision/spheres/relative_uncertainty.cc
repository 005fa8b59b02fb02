// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/spheres/relative_uncertainty.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <string>

#include "prescene/collision/spheres/distance_probability.h"

namespace prescene::collision {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using geometry::Matrix6d;

constexpr double kSymmetric = 1e-6;
// What is left of a pivot by cancellation, relative to the diagonal.
constexpr double kRounding = 1e-12;
constexpr double kNotNegative = 1e-6;
// Each of the four sizes that remainder() rests on (two rotations, two translations) is exceeded this often.
constexpr double kSizeFails = RelativeUncertainty::kRemainderFails / 4;
// Twice the rounding of a centre's transform and of a distance, relative to the coordinates: a dozen operations.
constexpr double kFloatRounding = 2e-6;

Matrix3d cross_matrix(const Vector3d& v) {
  Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

double largest_eigenvalue(const Matrix3d& m) {
  Eigen::SelfAdjointEigenSolver<Matrix3d> solver;
  solver.computeDirect(m, Eigen::EigenvaluesOnly);
  return std::max(0.0, solver.eigenvalues()[2]) + 1e-7 * m.cwiseAbs().maxCoeff();
}

/// Lower triangular factor of a semidefinite matrix: rows without variance of their own get no column.
bool factorize(const Matrix6d& covariance, Matrix6d& factor) {
  factor.setZero();
  for (int j = 0; j < 6; ++j) {
    const double pivot = covariance(j, j) - factor.row(j).head(j).squaredNorm();
    if (!(pivot >= -kNotNegative * covariance(j, j))) return false;
    if (pivot <= kRounding * covariance(j, j)) continue;
    factor(j, j) = std::sqrt(pivot);
    for (int i = j + 1; i < 6; ++i)
      factor(i, j) = (covariance(i, j) - factor.row(i).head(j).dot(factor.row(j).head(j))) / factor(j, j);
  }
  return true;
}

core::Status check(const Matrix6d& covariance, const char* name) {
  if (!covariance.allFinite())
    return core::invalid_input(std::string("the covariance of body ") + name +
                               " is not finite; check the filter's output");
  const double off = (covariance - covariance.transpose()).cwiseAbs().maxCoeff();
  if (off > kSymmetric * covariance.cwiseAbs().maxCoeff()) {
    return core::invalid_input(std::string("the covariance of body ") + name + " is not symmetric (off by " +
                               std::to_string(off) + "); use 0.5 (C + C^T)");
  }
  Matrix6d factor;
  if (covariance.diagonal().minCoeff() < 0.0 || !factorize(covariance, factor)) {
    return core::invalid_input(std::string("the covariance of body ") + name +
                               " is not positive semidefinite; its variances along some direction are negative");
  }
  return {};
}

}  // namespace

core::Result<RelativeUncertainty> RelativeUncertainty::make(const UncertainPose& a, const UncertainPose& b,
                                                            double confidence) {
  if (!(confidence >= 0.5 && confidence <= 1.0 - 1e-9))
    return core::invalid_input("a confidence of " + std::to_string(confidence) + "; choose one in [0.5, 1 - 1e-9]");
  core::Result<Transform> X_AB = relative_transform(a.X_WB, b.X_WB);
  if (!X_AB.ok()) return X_AB.status();
  PRESCENE_RETURN_IF_ERROR(check(a.covariance, "A"));
  PRESCENE_RETURN_IF_ERROR(check(b.covariance, "B"));

  RelativeUncertainty result;
  result.X_AB_ = *X_AB;
  result.confidence_ = confidence;
  result.region_radius_ = six_dimensional_radius(1.0 - confidence);
  result.ball_radius_ = three_dimensional_radius(1.0 - confidence);
  const Matrix3d R_AW = a.X_WB.rotation.normalized().toRotationMatrix().transpose();
  const Matrix3d R_AB = R_AW * b.X_WB.rotation.normalized().toRotationMatrix();
  const Vector3d p_AB = R_AW * (b.X_WB.translation - a.X_WB.translation);
  Matrix6d from_a = Matrix6d::Zero();
  from_a.topLeftCorner<3, 3>() = -Matrix3d::Identity();
  from_a.bottomRightCorner<3, 3>() = -R_AW;
  Matrix6d from_b = Matrix6d::Zero();
  from_b.topLeftCorner<3, 3>() = R_AB;
  from_b.bottomLeftCorner<3, 3>() = cross_matrix(p_AB) * R_AB;
  from_b.bottomRightCorner<3, 3>() = R_AW;
  const Matrix6d sum = from_a * a.covariance * from_a.transpose() + from_b * b.covariance * from_b.transpose();
  result.covariance_ = 0.5 * (sum + sum.transpose());
  if (!factorize(result.covariance_, result.factor_))
    return core::invalid_input("the covariances of the bodies are not positive semidefinite");
  result.set_growth(a, b);
  return result;
}

void RelativeUncertainty::set_growth(const UncertainPose& a, const UncertainPose& b) {
  const Matrix3d rotation = covariance_.topLeftCorner<3, 3>();
  const Matrix3d mixed = covariance_.bottomLeftCorner<3, 3>();  // E[tau phi^T]
  const Vector3d p_AB(static_cast<double>(X_AB_.translation[0]), static_cast<double>(X_AB_.translation[1]),
                      static_cast<double>(X_AB_.translation[2]));
  pivot_ = p_AB;
  // The trace of covariance_at(p) is p^T M p + 2 v . p + const with M = tr(C) I - C and v = E[tau x phi].
  if (rotation.trace() > 0.0) {
    const Matrix3d M = rotation.trace() * (1.0 + 1e-9) * Matrix3d::Identity() - rotation;
    const Vector3d v(mixed(1, 2) - mixed(2, 1), mixed(2, 0) - mixed(0, 2), mixed(0, 1) - mixed(1, 0));
    // Solved for the offset from B's origin: the components that don't matter stay there.
    pivot_ += M.ldlt().solve(-v - M * p_AB);
  }
  const Matrix3d mixed_at_pivot = mixed - cross_matrix(pivot_) * rotation;
  at_pivot_ = largest_eigenvalue(covariance_at(pivot_));
  linear_ = 2.0 * std::sqrt(largest_eigenvalue(mixed_at_pivot.transpose() * mixed_at_pivot));
  quadratic_ = largest_eigenvalue(rotation);

  // |exp(phi) c - c - phi x c| <= |phi|^2 |c| / 2, and the errors of B are turned by those of A.
  const double reach = three_dimensional_radius(kSizeFails);
  const auto size = [&](const Matrix3d& covariance) { return reach * std::sqrt(largest_eigenvalue(covariance)); };
  const double turn_a = size(a.covariance.topLeftCorner<3, 3>());
  const double turn_b = size(b.covariance.topLeftCorner<3, 3>());
  const double shift = size(a.covariance.bottomRightCorner<3, 3>()) + size(b.covariance.bottomRightCorner<3, 3>());
  const double of_b = 0.5 * turn_b * turn_b * (1.0 + turn_a) + turn_a * turn_b;
  const double of_a = 0.5 * turn_a * turn_a;
  remainder_slope_ = of_a + of_b + kFloatRounding;
  remainder_ = of_b * (pivot_ - p_AB).norm() + of_a * pivot_.norm() + turn_a * shift +
               kFloatRounding * (pivot_.norm() + p_AB.norm());
}

Eigen::Matrix<double, 3, 6> RelativeUncertainty::displacement_at(const Vector3d& p) const {
  return factor_.bottomRows<3>() - cross_matrix(p) * factor_.topRows<3>();
}

Matrix3d RelativeUncertainty::covariance_at(const Vector3d& p) const {
  const Eigen::Matrix<double, 3, 6> D = displacement_at(p);
  return D * D.transpose();
}

double RelativeUncertainty::deviation_bound(double distance_to_pivot) const {
  return std::sqrt(at_pivot_ + distance_to_pivot * (linear_ + distance_to_pivot * quadratic_));
}

}  // namespace prescene::collision
