// SPDX-License-Identifier: Apache-2.0
#include "principal_axes.h"

#include <Eigen/Eigenvalues>
#include <limits>

namespace prescene::collision {

bool PointMoments::principal_axes(Eigen::Matrix3f* R) const {
  const Eigen::Vector3f s = sum_;
  Eigen::Matrix3f covariance;
  covariance << squares_[0], products_[2], products_[1],  //
      products_[2], squares_[1], products_[0],            //
      products_[1], products_[0], squares_[2];
  covariance -= s * s.transpose() / count_;
  const float scale = covariance.trace();
  if (!(scale > std::numeric_limits<float>::min()) || !covariance.allFinite()) return false;
  covariance /= scale;
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f> solver;
  solver.computeDirect(covariance);
  const Eigen::Matrix3f vectors = solver.eigenvectors();
  if (!vectors.allFinite()) return false;
  // Orthonormal to the last bits: the direct solver's are not, for close eigenvalues.
  const Eigen::Vector3f x = vectors.col(0).normalized();
  Eigen::Vector3f y = vectors.col(1) - x * x.dot(vectors.col(1));
  if (!(y.norm() > 0.5F)) return false;
  y.normalize();
  R->row(0) = x.transpose();
  R->row(1) = y.transpose();
  R->row(2) = x.cross(y).normalized().transpose();
  return R->allFinite();
}

}  // namespace prescene::collision
