// SPDX-License-Identifier: Apache-2.0
#include "prescene/geometry/pose_error.h"

#include <cmath>

namespace prescene::geometry {

AddsEvaluator::AddsEvaluator(std::vector<Vector3d> points) : points_(std::move(points)), tree_(points_) {}

double AddsEvaluator::add(const Pose& X_estimate, const Pose& X_truth) const {
  const Pose X_ET = X_estimate.inverse() * X_truth;
  const Matrix3d R_ET = X_ET.rotation.toRotationMatrix();
  double sum = 0.0;
  for (const Vector3d& p : points_) sum += (R_ET * p + X_ET.translation - p).norm();
  return sum / static_cast<double>(points_.size());
}

double AddsEvaluator::adds(const Pose& X_estimate, const Pose& X_truth) const {
  const Pose X_ET = X_estimate.inverse() * X_truth;
  const Matrix3d R_ET = X_ET.rotation.toRotationMatrix();
  double sum = 0.0;
  // Good first candidates: the point itself when the error is small, else what the neighbouring point found.
  std::uint32_t previous = 0;
  for (const std::uint32_t i : tree_.order()) {
    const Vector3d q = R_ET * points_[i] + X_ET.translation;
    const bool own = (points_[i] - q).squaredNorm() < (points_[previous] - q).squaredNorm();
    const PointTree::Nearest found = tree_.nearest(q, own ? i : previous);
    previous = found.index;
    sum += std::sqrt(found.squared_distance);
  }
  return sum / static_cast<double>(points_.size());
}

}  // namespace prescene::geometry
