// SPDX-License-Identifier: Apache-2.0
// From sums over pairs to the covariance of the wrench.
#include <Eigen/Core>
#include <array>

#include "uncertain_lanes.h"

namespace prescene::collision {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using geometry::Matrix6d;

/// A tensor that is symmetric in all of its three indices, from its entries i <= j <= k.
template <int N>
std::array<Eigen::Matrix<double, N, N>, std::size_t{N}> symmetric_tensor(const double* entries) {
  std::array<Eigen::Matrix<double, N, N>, std::size_t{N}> t;
  const auto at = [&](int i, int j, int k) -> double& { return t[static_cast<std::size_t>(i)](j, k); };
  for (int i = 0; i < N; ++i) {
    for (int j = i; j < N; ++j) {
      for (int k = j; k < N; ++k)
        at(i, j, k) = at(i, k, j) = at(j, i, k) = at(j, k, i) = at(k, i, j) = at(k, j, i) = *entries++;
    }
  }
  return t;
}

/// A symmetric matrix from its upper triangle.
Matrix6d symmetric(const double* upper) {
  Matrix6d m;
  for (int i = 0; i < 6; ++i) {
    for (int j = i; j < 6; ++j) m(i, j) = m(j, i) = *upper++;
  }
  return m;
}
/// Expected derivative of the wrench (force, torque) on B by the error (phi, tau), for unit stiffness.
Matrix6d wrench_gradient(const WrenchSums& sums) {
  const Matrix6d normal = symmetric(sums.sums.data() + WrenchSums::kNormal);
  Matrix6d gradient;  // Rows of (c, n) swap: the wrench is (n, c).
  gradient.topRows<3>() = -normal.bottomRows<3>();
  gradient.bottomRows<3>() = -normal.topRows<3>();
  const double* s = sums.sums.data() + WrenchSums::kSideways;
  const Matrix3d of_p = geometry::cross_matrix(Vector3d(s[1], s[2], s[3]));
  const Matrix3d of_a = geometry::cross_matrix(Vector3d(s[4], s[5], s[6]));
  Matrix3d outer;  // sum of w a p^T
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) outer(i, j) = s[7 + 3 * i + j];
  }
  // [a]x [p]x = p a^T - (a . p) I
  gradient.topLeftCorner<3, 3>() -= of_p;
  gradient.topRightCorner<3, 3>() += s[0] * Matrix3d::Identity();
  gradient.bottomLeftCorner<3, 3>() -= outer.transpose() - outer.trace() * Matrix3d::Identity();
  gradient.bottomRightCorner<3, 3>() += of_a;
  return gradient;
}

}  // namespace

void add_bending(const LocalSums& local, SymmetricTensor* bending) {
  const double* sums = local.sums.data();
  const double weight = sums[LocalSums::kWeight];
  if (weight <= 0.0) return;
  std::array<Matrix3d, 3> H = symmetric_tensor<3>(sums + LocalSums::kCubic);
  for (Matrix3d& of_i : H) of_i *= -3.0;
  for (Eigen::Index i = 0; i < 3; ++i) {
    const double b = sums[LocalSums::kBent + static_cast<std::size_t>(i)];
    H[static_cast<std::size_t>(i)] += b * Matrix3d::Identity();
    for (Eigen::Index j = 0; j < 3; ++j) {
      H[static_cast<std::size_t>(j)](i, j) += b;
      H[static_cast<std::size_t>(j)](j, i) += b;
    }
  }
  // m = lever * n at the mean place.
  Eigen::Matrix<double, 6, 3> lever;
  lever << geometry::cross_matrix(Eigen::Map<const Vector3d>(sums + LocalSums::kPlace) / weight), Matrix3d::Identity();
  for (std::size_t j = 0; j < 3; ++j) {
    const Matrix6d spread = lever * H[j] * lever.transpose();
    for (std::size_t i = 0; i < 6; ++i)
      (*bending)[i] += lever(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) * spread;
  }
}

Matrix6d wrench_covariance(const WrenchSums& sums, const Matrix6d& factor) {
  const Matrix6d first = wrench_gradient(sums) * factor;
  const Matrix6d swapped = symmetric(sums.sums.data() + WrenchSums::kRest) * factor;
  Matrix6d rest;  // rows of (n, c) instead of (c, n)
  rest << swapped.bottomRows<3>(), swapped.topRows<3>();
  Matrix6d covariance = first * first.transpose() + rest * rest.transpose();
  // Second order: half the inner products of the second derivatives, each a matrix over the normal numbers.
  SymmetricTensor bend = symmetric_tensor<6>(sums.sums.data() + WrenchSums::kKink);
  for (std::size_t i = 0; i < 6; ++i) bend[i] = factor.transpose() * (bend[i] + sums.bending[i]) * factor;
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = 0; j < 6; ++j) {
      covariance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) +=
          0.5 * bend[(i + 3) % 6].cwiseProduct(bend[(j + 3) % 6]).sum();
    }
  }
  return covariance;
}

UncertainWrench about_point(const UncertainWrench& wrench, const Eigen::Vector3d& p_AP) {
  Matrix3d cross;
  cross << 0.0, -p_AP.z(), p_AP.y(), p_AP.z(), 0.0, -p_AP.x(), -p_AP.y(), p_AP.x(), 0.0;
  geometry::Matrix6d shift = geometry::Matrix6d::Identity();
  shift.bottomLeftCorner<3, 3>() = -cross;
  UncertainWrench about = wrench;
  about.torque -= p_AP.cross(wrench.force);
  about.covariance = shift * wrench.covariance * shift.transpose();
  return about;
}

}  // namespace prescene::collision
