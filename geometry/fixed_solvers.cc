// SPDX-License-Identifier: Apache-2.0
// The solvers of dense_solvers.h for matrices whose size is known.
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

Quaterniond rotation_between(const Vector3d& from, const Vector3d& to) { return Quaterniond::FromTwoVectors(from, to); }

}  // namespace prescene::geometry
