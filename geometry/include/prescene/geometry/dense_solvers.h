// SPDX-License-Identifier: Apache-2.0
// Eigen's decompositions of matrices of any size or of 6 x 6, compiled once: each costs seconds in every source that
// instantiates it.
//
//   const SymmetricEigen eigen = symmetric_eigen(covariance);
//   const Eigen::MatrixXd root = eigen.vectors * eigen.values.cwiseMax(0.0).cwiseSqrt().asDiagonal();
#pragma once

#include <Eigen/Core>

#include "prescene/geometry/pose.h"

namespace prescene::geometry {

/// A = vectors * values.asDiagonal() * vectors^T, values ascending.
struct SymmetricEigen {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;
};
/// Of a symmetric matrix, of which the lower triangle is read (SelfAdjointEigenSolver).
SymmetricEigen symmetric_eigen(const Eigen::MatrixXd& A);

/// X with A X = B for a symmetric, positive or negative semidefinite A (LDLT).
Eigen::MatrixXd solve_symmetric(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);
/// The X with the least |A X - B| for an A of full column rank and no fewer rows than columns (ColPivHouseholderQR).
Eigen::MatrixXd solve_least_squares(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);
/// X with A X = B, and A^-1, of a square, invertible A (PartialPivLU).
Eigen::MatrixXd solve(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);
Eigen::MatrixXd inverse(const Eigen::MatrixXd& A);
/// The Moore-Penrose inverse (CompleteOrthogonalDecomposition).
Eigen::MatrixXd pseudo_inverse(const Eigen::MatrixXd& A);
/// The lower triangular L with L L^T = A, of a symmetric, positive definite matrix (LLT).
Eigen::MatrixXd cholesky_factor(const Eigen::MatrixXd& A);
/// L^-1 B of a lower triangular L.
Eigen::MatrixXd solve_lower(const Eigen::MatrixXd& L, const Eigen::MatrixXd& B);

/// As symmetric_eigen and its values alone, for matrices of six degrees of freedom (SelfAdjointEigenSolver).
struct SymmetricEigen6 {
  Vector6d values;
  Matrix6d vectors;
};
SymmetricEigen6 symmetric_eigen_6(const Matrix6d& A);
Vector6d symmetric_eigenvalues_6(const Matrix6d& A);

/// The smallest rotation that takes the direction of `from` to that of `to`, both not zero; of opposite directions one
/// of the half turns, by a singular value decomposition (Quaterniond::FromTwoVectors).
Quaterniond rotation_between(const Vector3d& from, const Vector3d& to);

}  // namespace prescene::geometry
