// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/spheres/relative_uncertainty.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "prescene/collision/spheres/distance_probability.h"
#include "prescene/core/text.h"
#include "prescene/geometry/dense_solvers.h"

namespace prescene::collision {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using geometry::Matrix6d;
using geometry::Vector6d;

constexpr double kSymmetric = 1e-6;
// What is left of a pivot by cancellation, relative to the diagonal.
constexpr double kRounding = 1e-12;
constexpr double kNotNegative = 1e-6;
// As far as bodies may be apart, squared.
constexpr double kLargestVariance = 1e18;
// Each of the four sizes that remainder() rests on (two rotations, two translations) is exceeded this often.
constexpr double kSizeFails = RelativeUncertainty::kRemainderFails / 4;
// Twice the rounding of a centre's transform and of a distance, relative to the coordinates: a dozen operations.
constexpr double kFloatRounding = 2e-6;

double largest_eigenvalue(const Matrix3d& m) {
  return std::max(0.0, geometry::symmetric_eigenvalues_3_direct(m)[2]) + 1e-7 * m.cwiseAbs().maxCoeff();
}

Matrix3d rotation_of(const Transform& X) {
  return Eigen::Map<const Eigen::Matrix<float, 3, 3, Eigen::RowMajor>>(X.rotation.data()).cast<double>();
}
Vector3d translation_of(const Transform& X) { return Eigen::Map<const Vector3f>(X.translation.data()).cast<double>(); }

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

/// Also factorizes it.
core::Status check(const Matrix6d& covariance, const char* name, Matrix6d& factor) {
  if (!covariance.allFinite())
    return core::invalid_input(std::string("the covariance of body ") + name +
                               " is not finite; check the filter's output");
  if (covariance.cwiseAbs().maxCoeff() > kLargestVariance) {
    return core::invalid_input(std::string("the covariance of body ") + name +
                               " has entries beyond 1e18 m^2; check its " + "units (rad^2, rad m, m^2)");
  }
  const double off = (covariance - covariance.transpose()).cwiseAbs().maxCoeff();
  if (off > kSymmetric * covariance.cwiseAbs().maxCoeff()) {
    return core::invalid_input(std::string("the covariance of body ") + name + " is not symmetric (off by " +
                               core::rounded_text(off) + "); use 0.5 (C + C^T)");
  }
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
    return core::invalid_input("a confidence of " + core::rounded_text(confidence) + "; choose one in [0.5, 1 - 1e-9]");
  core::Result<Transform> X_AB = relative_transform(a.X_WB, b.X_WB);
  if (!X_AB.ok()) return X_AB.status();
  RelativeUncertainty result;
  PRESCENE_RETURN_IF_ERROR(check(a.covariance, "A", result.factor_a_));
  PRESCENE_RETURN_IF_ERROR(check(b.covariance, "B", result.factor_b_));
  result.X_AB_ = *X_AB;
  result.confidence_ = confidence;
  result.region_radius_ = six_dimensional_radius(1.0 - confidence);
  result.ball_radius_ = three_dimensional_radius(1.0 - confidence);
  const Matrix3d R_AW = a.X_WB.rotation.normalized().toRotationMatrix().transpose();
  const Matrix3d R_AB = R_AW * b.X_WB.rotation.normalized().toRotationMatrix();
  const Vector3d p_AB = R_AW * (b.X_WB.translation - a.X_WB.translation);
  result.mean_ = {geometry::Quaterniond(R_AB), p_AB};
  for (Matrix6d* factor : {&result.factor_a_, &result.factor_b_})
    factor->bottomRows<3>() = R_AW * factor->bottomRows<3>();
  Matrix6d from_a = Matrix6d::Zero();
  from_a.topLeftCorner<3, 3>() = -Matrix3d::Identity();
  from_a.bottomRightCorner<3, 3>() = -R_AW;
  Matrix6d from_b = Matrix6d::Zero();
  from_b.topLeftCorner<3, 3>() = R_AB;
  from_b.bottomLeftCorner<3, 3>() = geometry::cross_matrix(p_AB) * R_AB;
  from_b.bottomRightCorner<3, 3>() = R_AW;
  const Matrix6d sum = from_a * a.covariance * from_a.transpose() + from_b * b.covariance * from_b.transpose();
  result.covariance_ = 0.5 * (sum + sum.transpose());
  if (!factorize(result.covariance_, result.factor_)) {
    // Variances too different for their sum: joined by their factors, which never fails.
    Eigen::Matrix<double, 6, 12> joined;
    joined.leftCols<6>() = -result.factor_a_;
    joined.topRightCorner<3, 6>() = R_AB * result.factor_b_.topRows<3>();
    joined.bottomRightCorner<3, 6>() =
        geometry::cross_matrix(p_AB) * joined.topRightCorner<3, 6>() + result.factor_b_.bottomRows<3>();
    result.factor_ = geometry::triangular_factor(joined.transpose()).transpose();
    result.covariance_ = result.factor_ * result.factor_.transpose();
  }
  result.set_growth(a, b);
  return result;
}

void RelativeUncertainty::set_growth(const UncertainPose& a, const UncertainPose& b) {
  const Matrix3d rotation = covariance_.topLeftCorner<3, 3>();
  const Matrix3d mixed = covariance_.bottomLeftCorner<3, 3>();  // E[tau phi^T]
  const Vector3d p_AB = translation_of(X_AB_);
  pivot_ = p_AB;
  // The trace of covariance_at(p) is p^T M p + 2 v . p + const with M = tr(C) I - C and v = E[tau x phi].
  if (rotation.trace() > 0.0) {
    const Matrix3d M = rotation.trace() * (1.0 + 1e-9) * Matrix3d::Identity() - rotation;
    const Vector3d v(mixed(1, 2) - mixed(2, 1), mixed(2, 0) - mixed(0, 2), mixed(0, 1) - mixed(1, 0));
    // Solved for the offset from B's origin: the components that don't matter stay there.
    pivot_ += geometry::solve_symmetric_3(M, -v - M * p_AB);
  }
  const Matrix3d mixed_at_pivot = mixed - geometry::cross_matrix(pivot_) * rotation;
  const Matrix3d least = covariance_at(pivot_);
  least_trace_ = least.trace();
  at_pivot_ = largest_eigenvalue(least);
  linear_ = 2.0 * std::sqrt(largest_eigenvalue(mixed_at_pivot.transpose() * mixed_at_pivot));
  quadratic_ = largest_eigenvalue(rotation);

  size_radius_ = three_dimensional_radius(kSizeFails);
  const auto size = [&](const Matrix3d& covariance) {
    return size_radius_ * std::sqrt(largest_eigenvalue(covariance));
  };
  const double turn_a = size(a.covariance.topLeftCorner<3, 3>());
  const double turn_b = size(b.covariance.topLeftCorner<3, 3>());
  const double shift = size(a.covariance.bottomRightCorner<3, 3>()) + size(b.covariance.bottomRightCorner<3, 3>());
  const double rounding = kFloatRounding * (pivot_.norm() + p_AB.norm());
  // |exp(phi) c - c - phi x c| <= |phi|^2 |c| / 2, and the errors of the body that moves are turned by those of the one
  // that looks.
  const auto of_moving = [](double moving, double looking) {
    return 0.5 * moving * moving * (1.0 + looking) + looking * moving;
  };
  const auto of_looking = [](double looking) { return 0.5 * looking * looking; };
  remainder_slope_ = of_looking(turn_a) + of_moving(turn_b, turn_a) + kFloatRounding;
  remainder_ = of_moving(turn_b, turn_a) * (pivot_ - p_AB).norm() + of_looking(turn_a) * pivot_.norm() +
               turn_a * shift + rounding;
  reversed_remainder_slope_ = of_looking(turn_b) + of_moving(turn_a, turn_b) + kFloatRounding;
  turns_a_ = a.covariance.topLeftCorner<3, 3>();
  const Matrix3d R_AB = rotation_of(X_AB_);
  turns_b_ = R_AB * b.covariance.topLeftCorner<3, 3>() * R_AB.transpose();
  most_turn_a_ = turn_a;
  most_turn_b_ = turn_b;
  most_shift_ = shift;
  reversed_remainder_ = of_moving(turn_a, turn_b) * pivot_.norm() + of_looking(turn_b) * (pivot_ - p_AB).norm() +
                        turn_b * shift + rounding;
}

Transform RelativeUncertainty::displaced(const Eigen::Matrix<double, 12, 1>& z) const {
  const Vector6d error_a = factor_a_ * z.head<6>();
  const Vector6d error_b = factor_b_ * z.tail<6>();
  const geometry::Quaterniond back = geometry::exp_rotation(-error_a.head<3>());
  const Matrix3d R = (back * mean_.rotation * geometry::exp_rotation(error_b.head<3>())).toRotationMatrix();
  const Vector3d p = back * (mean_.translation + error_b.tail<3>() - error_a.tail<3>());
  Transform X;
  Eigen::Map<Eigen::Matrix<float, 3, 3, Eigen::RowMajor>>(X.rotation.data()) = R.cast<float>();
  Eigen::Map<Vector3f>(X.translation.data()) = p.cast<float>();
  return X;
}

double RelativeUncertainty::Along::largest_across(const Matrix3d& covariance) const {
  const Vector3d u = n_.unitOrthogonal();
  const Vector3d v = n_.cross(u);
  const Vector3d Cu = covariance * u;
  const double uu = u.dot(Cu);
  const double vv = v.dot(covariance * v);
  const double uv = v.dot(Cu);
  const double half = 0.5 * (uu - vv);
  return std::max(0.0, 0.5 * (uu + vv) + std::sqrt(half * half + uv * uv)) + 1e-12 * (uu + vv);
}

// See kSizeFails: of three normal numbers, one alone or two exceed the radius a quarter as often at most.
RelativeUncertainty::Along::Turns RelativeUncertainty::Along::turns(const Matrix3d& covariance) const {
  Turns turns;
  const double about = std::max(0.0, n_.dot(covariance * n_));
  const double across = largest_across(covariance);
  turns.about = between_->size_radius_ * std::sqrt(about);
  turns.across = between_->size_radius_ * std::sqrt(across);
  turns.both = between_->size_radius_ * std::sqrt(about + across);
  return turns;
}

RelativeUncertainty::Along::Along(const RelativeUncertainty& between, const Vector3d& n)
    : between_(&between), n_(n), tilt_(std::sqrt(largest_across(between.covariance_.topLeftCorner<3, 3>()))) {
  if (between.most_turn_a_ > 0.0) a_ = turns(between.turns_a_);
  if (between.most_turn_b_ > 0.0) b_ = turns(between.turns_b_);
}

double RelativeUncertainty::Along::remainder(const Vector3d& p, double radius) const {
  const Vector3d p_AB = translation_of(between_->X_AB_);
  const double of_p = p.norm() + radius;
  const double from_b = (p - p_AB).norm() + radius;
  double missed = 2.0 * kFloatRounding * (of_p + from_b + p_AB.norm());
  // n . (exp(phi) p - p - phi x p) with phi = about n + across, by the formula of Rodrigues: 1 - cos t <= t^2 / 2 and
  // t - sin t <= t^3 / 6, and n . phi x (phi x p) = about (across . p) - across^2 (n . p).
  const double height = std::abs(n_.dot(p)) + radius;
  const double beside = p.cross(n_).norm() + radius;
  missed += a_.across * (0.5 * (a_.about * beside + a_.across * height) + a_.both * a_.both / 6.0 * beside);
  // B's turns turn n, and what they see has moved by A's errors.
  const double moved = between_->most_turn_a_ * of_p + between_->most_shift_;
  missed += b_.across * (moved + (0.5 * b_.both + b_.both * b_.both / 6.0) * (from_b + moved));
  return std::min(missed, between_->reversed_remainder((p - between_->pivot_).norm() + radius));
}

Vector6d RelativeUncertainty::slope_along(const Vector3d& n, const Vector3d& p) const {
  Vector6d weights;
  weights << p.cross(n), n;
  return -(factor_.transpose() * weights);
}

double RelativeUncertainty::reversed_displacement(const Vector3d& p) const {
  const double moved = most_turn_a_ * p.norm() + most_shift_;
  return moved + most_turn_b_ * ((p - translation_of(X_AB_)).norm() + moved);
}

Eigen::Matrix<double, 3, 6> RelativeUncertainty::displacement_at(const Vector3d& p) const {
  return factor_.bottomRows<3>() - geometry::cross_matrix(p) * factor_.topRows<3>();
}

Matrix3d RelativeUncertainty::covariance_at(const Vector3d& p) const {
  const Eigen::Matrix<double, 3, 6> D = displacement_at(p);
  return D * D.transpose();
}

double RelativeUncertainty::deviation_bound(double distance_to_pivot) const {
  return std::sqrt(at_pivot_ + distance_to_pivot * (linear_ + distance_to_pivot * quadratic_));
}

}  // namespace prescene::collision
