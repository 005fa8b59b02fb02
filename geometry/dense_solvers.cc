// SPDX-License-Identifier: Apache-2.0
#include "prescene/geometry/dense_solvers.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>

namespace prescene::geometry {

using Eigen::MatrixXd;

SymmetricEigen symmetric_eigen(const MatrixXd& A) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(A);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

MatrixXd product(const MatrixXd& A, const MatrixXd& B) { return A * B; }

MatrixXd solve_symmetric(const MatrixXd& A, const MatrixXd& B) { return A.ldlt().solve(B); }

MatrixXd solve_least_squares(const MatrixXd& A, const MatrixXd& B) { return A.colPivHouseholderQr().solve(B); }

MatrixXd solve(const MatrixXd& A, const MatrixXd& B) { return A.partialPivLu().solve(B); }

MatrixXd inverse(const MatrixXd& A) { return A.inverse(); }

MatrixXd pseudo_inverse(const MatrixXd& A) { return A.completeOrthogonalDecomposition().pseudoInverse(); }

MatrixXd cholesky_factor(const MatrixXd& A) { return A.llt().matrixL(); }

MatrixXd triangular_factor(const MatrixXd& A) {
  const Eigen::HouseholderQR<MatrixXd> qr(A);
  return qr.matrixQR().topRows(A.cols()).triangularView<Eigen::Upper>();
}

MatrixXd solve_lower(const MatrixXd& L, const MatrixXd& B) { return L.triangularView<Eigen::Lower>().solve(B); }

}  // namespace prescene::geometry
