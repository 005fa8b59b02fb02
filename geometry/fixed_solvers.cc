// SPDX-License-Identifier: Apache-2.0
// The solvers of dense_solvers.h for matrices whose size is known.
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include "prescene/geometry/dense_solvers.h"

namespace prescene::geometry {

SymmetricEigen6 symmetric_eigen_6(const Matrix6d& A) {
  const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(A);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

Vector6d symmetric_eigenvalues_6(const Matrix6d& A) {
  return Eigen::SelfAdjointEigenSolver<Matrix6d>(A, Eigen::EigenvaluesOnly).eigenvalues();
}

Cholesky6::Cholesky6(const Matrix6d& A) {
  const Eigen::LLT<Matrix6d> llt(A);
  positive_definite_ = llt.info() == Eigen::Success;
  factor_ = llt.matrixL();
}

Vector6d Cholesky6::solve(const Vector6d& b) const {
  Vector6d x = b;
  factor_.triangularView<Eigen::Lower>().solveInPlace(x);
  factor_.adjoint().triangularView<Eigen::Upper>().solveInPlace(x);
  return x;
}

Matrix6d Cholesky6::inverse() const {
  Matrix6d X = Matrix6d::Identity();
  factor_.triangularView<Eigen::Lower>().solveInPlace(X);
  factor_.adjoint().triangularView<Eigen::Upper>().solveInPlace(X);
  return X;
}

Vector3d solve_symmetric_3(const Eigen::Matrix3d& A, const Vector3d& b) { return A.ldlt().solve(b); }

Quaterniond rotation_between(const Vector3d& from, const Vector3d& to) { return Quaterniond::FromTwoVectors(from, to); }

}  // namespace prescene::geometry
