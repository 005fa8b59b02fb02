// SPDX-License-Identifier: Apache-2.0
// Eigen's decompositions of matrices of any size and of the sizes of poses, compiled once: each costs seconds in every
// source that instantiates it.
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

/// A B.
Eigen::MatrixXd product(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);
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
/// The upper triangular R of A = Q R with an orthogonal Q, of no fewer rows than columns (HouseholderQR).
Eigen::MatrixXd triangular_factor(const Eigen::MatrixXd& A);
/// L^-1 B of a lower triangular L.
Eigen::MatrixXd solve_lower(const Eigen::MatrixXd& L, const Eigen::MatrixXd& B);

/// As symmetric_eigen and its values alone, for matrices of six degrees of freedom (SelfAdjointEigenSolver).
struct SymmetricEigen6 {
  Vector6d values;
  Matrix6d vectors;
};
SymmetricEigen6 symmetric_eigen_6(const Matrix6d& A);
Vector6d symmetric_eigenvalues_6(const Matrix6d& A);

/// As symmetric_eigen, for matrices of three rows: not by the closed form, which loses small ones of values that differ
/// much (SelfAdjointEigenSolver::compute).
struct SymmetricEigen3 {
  Vector3d values;
  Matrix3d vectors;
};
SymmetricEigen3 symmetric_eigen_3(const Matrix3d& A);
/// The values by the closed form, which is faster: errors of some 1e-8 of the largest one (computeDirect).
Vector3d symmetric_eigenvalues_3_direct(const Matrix3d& A);

/// A = L L^T of a symmetric matrix of six degrees of freedom, of which the lower triangle is read (LLT).
class Cholesky6 {
 public:
  explicit Cholesky6(const Matrix6d& A);
  /// False where A is not positive definite: the rest means nothing then.
  bool positive_definite() const { return positive_definite_; }
  /// L, zeros above its diagonal.
  const Matrix6d& factor() const { return factor_; }
  /// A^-1 b.
  Vector6d solve(const Vector6d& b) const;
  Matrix6d inverse() const;

 private:
  Matrix6d factor_;
  bool positive_definite_;
};

/// x with A x = b for a symmetric, positive or negative semidefinite A of three or six rows (LDLT).
Vector3d solve_symmetric_3(const Matrix3d& A, const Vector3d& b);
Vector6d solve_symmetric_6(const Matrix6d& A, const Vector6d& b);
/// A^-1 of an invertible A of six rows (PartialPivLU).
Matrix6d inverse_6(const Matrix6d& A);

/// The smallest rotation that takes the direction of `from` to that of `to`, both not zero; of opposite directions one
/// of the half turns (as Quaterniond::FromTwoVectors, without its singular value decomposition).
Quaterniond rotation_between(const Vector3d& from, const Vector3d& to);

}  // namespace prescene::geometry
