// SPDX-License-Identifier: Apache-2.0
#include "prescene/queries/path_error.h"

#include <cmath>

#include "prescene/core/check.h"
#include "prescene/geometry/dense_solvers.h"

namespace prescene::queries {
namespace {

using geometry::Matrix3d;
using geometry::Matrix6d;
using geometry::Vector3d;
using geometry::Vector6d;

double log_determinant_6(const geometry::Cholesky6& factored) {
  return 2.0 * factored.factor().diagonal().array().log().sum();
}

}  // namespace

PathError::PathError(double share, double radius, const Vector3d& up, const geometry::SymmetryGroup& symmetry)
    : share_(share), radius_(radius), up_(up), symmetry_(&symmetry) {
  PRESCENE_CHECK(share >= 0.0 && radius > 0.0);
}

void PathError::put_at(const FramePeak& peak, bool rests) {
  X_WO_ = peak.X_WO;
  placed_ = true;
  mean_.setZero();
  covariance_ = peak.covariance;
  if (!rests || !peak.lift) return;
  // That it rests is a measurement of its height.
  Vector6d upwards = Vector6d::Zero();
  upwards.tail<3>() = up_;
  const Vector6d with_height = covariance_ * upwards;
  const Vector6d gain = with_height / (upwards.dot(with_height) + kRestHeight * kRestHeight);
  mean_ = -*peak.lift * gain;
  const Matrix6d left = covariance_ - gain * with_height.transpose();
  covariance_ = 0.5 * (left + left.transpose());
}

geometry::Pose PathError::pose() const {
  return {(geometry::exp_rotation(mean_.head<3>()) * X_WO_.rotation).normalized(), X_WO_.translation + mean_.tail<3>()};
}

Matrix6d PathError::growth(const Vector3d& shift, const Vector3d& turn) const {
  const double way = share_ * (shift.norm() + radius_ * turn.norm());
  const double lift = share_ * (std::abs(up_.dot(shift)) + radius_ * (turn - up_ * up_.dot(turn)).norm());
  const Matrix3d along = up_ * up_.transpose(), across = Matrix3d::Identity() - along;
  Matrix6d grown = Matrix6d::Zero();
  grown.topLeftCorner<3, 3>() = (way * way * along + lift * lift * across) / (radius_ * radius_);
  grown.bottomRightCorner<3, 3>() = way * way * across + lift * lift * along;
  return grown;
}

void PathError::move_to(const geometry::Pose& X_WO) {
  if (placed_ && share_ > 0.0)
    covariance_ += growth(X_WO.translation - X_WO_.translation,
                          geometry::log_rotation(X_WO.rotation * X_WO_.rotation.conjugate()));
  X_WO_ = X_WO;
  placed_ = true;
}

Matrix6d turns_about_W(const geometry::Pose& X_WO, const Matrix6d& covariance) {
  Matrix6d along_W = Matrix6d::Identity();
  along_W.topLeftCorner<3, 3>() = X_WO.rotation.toRotationMatrix();
  return along_W * covariance * along_W.transpose();
}

Vector6d PathError::innovation(const FramePeak& peak) const {
  const geometry::Pose X = symmetry_->trivial() ? X_WO_ : geometry::closest_equivalent(X_WO_, peak.X_WO, *symmetry_);
  Vector6d seen;
  seen.head<3>() = geometry::log_rotation(peak.X_WO.rotation * X.rotation.conjugate());
  seen.tail<3>() = peak.X_WO.translation - X.translation;
  return seen - mean_;
}

PeakShape::PeakShape(const FramePeak& peak) {
  const geometry::Cholesky6 factored(peak.covariance);
  inverse = factored.inverse();
  log_determinant = log_determinant_6(factored);
}

PathFit PathError::fit(const FramePeak& peak, const PeakShape& shape) const {
  const Vector6d off = innovation(peak);
  const geometry::Cholesky6 both(covariance_ + peak.covariance);
  PathFit fit;
  fit.spread = shape.inverse.cwiseProduct(covariance_).sum();
  fit.mahalanobis = off.dot(both.solve(off));
  fit.log_likelihood = peak.log_peak + 0.5 * (shape.log_determinant - log_determinant_6(both)) - 0.5 * fit.mahalanobis;
  return fit;
}

void PathError::learn(const FramePeak& peak) {
  if (covariance_.isZero(0.0)) return;  // A path without error learns nothing.
  const geometry::Cholesky6 both(covariance_ + peak.covariance);
  const Matrix6d gain = covariance_ * both.inverse();
  mean_ += gain * innovation(peak);
  const Matrix6d left = covariance_ - gain * covariance_;
  covariance_ = 0.5 * (left + left.transpose());
}

}  // namespace prescene::queries
