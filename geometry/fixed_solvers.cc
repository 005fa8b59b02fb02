// SPDX-License-Identifier: Apache-2.0
// The solvers of dense_solvers.h for matrices whose size is known.
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

#include "prescene/geometry/dense_solvers.h"

namespace prescene::geometry {

namespace {

// Compiled once for both of its users.
[[gnu::noinline]] Eigen::SelfAdjointEigenSolver<Matrix6d> decomposition(const Matrix6d& A, int options) {
  return Eigen::SelfAdjointEigenSolver<Matrix6d>(A, options);
}

}  // namespace

SymmetricEigen6 symmetric_eigen_6(const Matrix6d& A) {
  const auto solver = decomposition(A, Eigen::ComputeEigenvectors);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

Vector6d symmetric_eigenvalues_6(const Matrix6d& A) { return decomposition(A, Eigen::EigenvaluesOnly).eigenvalues(); }

SymmetricEigen3 symmetric_eigen_3(const Matrix3d& A) {
  const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(A);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

Vector3d symmetric_eigenvalues_3_direct(const Matrix3d& A) {
  Eigen::SelfAdjointEigenSolver<Matrix3d> solver;
  solver.computeDirect(A, Eigen::EigenvaluesOnly);
  return solver.eigenvalues();
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

Vector3d solve_symmetric_3(const Matrix3d& A, const Vector3d& b) { return A.ldlt().solve(b); }

Vector6d solve_symmetric_6(const Matrix6d& A, const Vector6d& b) { return A.ldlt().solve(b); }

Matrix6d inverse_6(const Matrix6d& A) { return A.inverse(); }

Quaterniond rotation_between(const Vector3d& from, const Vector3d& to) {
  constexpr double kOpposite = 1e-12;
  const Vector3d a = from.normalized(), b = to.normalized();
  const Vector3d axis = a.cross(b);
  const double c = a.dot(b);
  Quaterniond q;
  if (c < -1.0 + kOpposite) {  // the cosine says nothing about the angle any more, the sum of the directions does
    q.w() = 0.5 * (a + b).norm();
    q.vec() = 0.5 * (a - b).norm() * (axis.norm() > 1e-10 ? axis.normalized() : a.unitOrthogonal());
  } else {
    const double s = std::sqrt((1.0 + c) * 2.0);
    q.w() = 0.5 * s;
    q.vec() = axis * (1.0 / s);
  }
  return q;
}

}  // namespace prescene::geometry
