// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "prescene/core/random.h"
#include "prescene/geometry/dense_solvers.h"

namespace prescene::geometry {
namespace {

Vector3d some_direction(core::RandomStream& stream) {
  const double z = stream.normal(), y = stream.normal(), x = stream.normal();
  return Vector3d(x, y, z).normalized();
}

TEST(RotationBetween, TakesOneDirectionToTheOtherByTheSmallestAngle) {
  core::RandomStream stream(1, core::Purpose::kTest);
  for (int i = 0; i < 1000; ++i) {
    const Vector3d from = some_direction(stream), to = some_direction(stream);
    const Quaterniond R = rotation_between(from, to);
    // 1 + cos is divided by, and has the rounding of the cosine.
    constexpr double kRounding = 16.0 * std::numeric_limits<double>::epsilon();
    EXPECT_NEAR((R * from - to).norm(), 0.0, kRounding / (1.0 + from.dot(to)));
    EXPECT_NEAR(2.0 * std::acos(std::abs(R.w())), std::acos(from.dot(to)), 1e-7);
    const Quaterniond half_turn = rotation_between(from, -from);
    EXPECT_NEAR((half_turn * from + from).norm(), 0.0, 1e-7);
  }
}

TEST(SymmetricEigen6, ValuesAndVectorsMakeTheMatrix) {
  core::RandomStream stream(2, core::Purpose::kTest);
  for (int i = 0; i < 100; ++i) {
    Matrix6d A;
    for (double& x : A.reshaped()) x = stream.normal();
    A = (A + A.transpose()).eval();
    const auto [values, vectors] = symmetric_eigen_6(A);
    EXPECT_NEAR((vectors * values.asDiagonal() * vectors.transpose() - A).norm(), 0.0, 1e-12 * A.norm());
    EXPECT_NEAR((symmetric_eigenvalues_6(A) - values).norm(), 0.0, 1e-12 * A.norm());
    for (Eigen::Index k = 1; k < 6; ++k) EXPECT_LE(values[k - 1], values[k]);
  }
}

TEST(SymmetricEigen3, ValuesAndVectorsMakeTheMatrix) {
  core::RandomStream stream(3, core::Purpose::kTest);
  for (int i = 0; i < 100; ++i) {
    Matrix3d A;
    for (double& x : A.reshaped()) x = stream.normal();
    A = (A + A.transpose()).eval();
    const auto [values, vectors] = symmetric_eigen_3(A);
    EXPECT_NEAR((vectors * values.asDiagonal() * vectors.transpose() - A).norm(), 0.0, 1e-12 * A.norm());
    for (Eigen::Index k = 1; k < 3; ++k) EXPECT_LE(values[k - 1], values[k]);
  }
}

TEST(SolveSymmetric, SolvesSystemsOfThreeAndSixRows) {
  core::RandomStream stream(4, core::Purpose::kTest);
  for (int i = 0; i < 100; ++i) {
    Matrix6d root;
    for (double& x : root.reshaped()) x = stream.normal();
    const Matrix6d A = root * root.transpose() + 1e-3 * Matrix6d::Identity();
    Vector6d b;
    for (double& x : b) x = stream.normal();
    EXPECT_NEAR((A * solve_symmetric_6(A, b) - b).norm(), 0.0, 1e-9 * b.norm());
    const Matrix3d A_3 = A.topLeftCorner<3, 3>();
    EXPECT_NEAR((A_3 * solve_symmetric_3(A_3, b.head<3>()) - b.head<3>()).norm(), 0.0, 1e-9 * b.norm());
  }
}

TEST(Inverse6, TimesTheMatrixIsTheIdentity) {
  core::RandomStream stream(5, core::Purpose::kTest);
  for (int i = 0; i < 100; ++i) {
    Matrix6d A;
    for (double& x : A.reshaped()) x = stream.normal();
    const Matrix6d inverse = inverse_6(A);
    EXPECT_NEAR((A * inverse - Matrix6d::Identity()).norm(), 0.0, 1e-13 * A.norm() * inverse.norm());
  }
}

}  // namespace
}  // namespace prescene::geometry
