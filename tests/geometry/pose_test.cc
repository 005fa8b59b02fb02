// SPDX-License-Identifier: Apache-2.0
#include "prescene/geometry/pose.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "prescene/geometry/plane.h"
#include "tests/support/matchers.h"

namespace prescene::geometry {
namespace {

using tests::is_near;

constexpr double kPi = std::numbers::pi;

TEST(Pose, ComposesByFrames) {
  // B is 1 m along x of A and turned by 90 degrees about z; C is 2 m along x of B, so along y of A.
  const Pose X_AB{exp_rotation({0.0, 0.0, 0.5 * kPi}), {1.0, 0.0, 0.0}};
  const Pose X_BC = Pose::from_translation({2.0, 0.0, 0.0});
  EXPECT_THAT((X_AB * X_BC).translation, is_near(Vector3d(1.0, 2.0, 0.0), 1e-15));
  EXPECT_THAT(X_AB * Vector3d(0.0, 3.0, 0.5), is_near(Vector3d(-2.0, 0.0, 0.5), 1e-15));
  EXPECT_THAT(X_AB.inverse() * Vector3d(1.0, 2.0, 0.0), is_near(Vector3d(2.0, 0.0, 0.0), 1e-15));
  EXPECT_EQ(Pose::identity() * Pose::identity(), Pose());
}

TEST(Pose, MatrixHasRotationAndTranslation) {
  const Pose X{exp_rotation({0.0, 0.0, 0.5 * kPi}), {0.3, -0.2, 0.7}};
  Eigen::Matrix4d expected;
  expected << 0, -1, 0, 0.3, 1, 0, 0, -0.2, 0, 0, 1, 0.7, 0, 0, 0, 1;
  EXPECT_THAT(X.matrix(), is_near(expected, 1e-15));
}

TEST(Pose, FromMatrixFindsTheNearestRotation) {
  const Pose X{exp_rotation({0.3, -0.8, 1.1}), {0.3, -0.2, 0.7}};
  Eigen::Matrix4d m = X.matrix();
  m.topLeftCorner<3, 3>() *= 1.0 + 3e-4;  // Scaled alike in all directions: the nearest rotation is the one before.
  EXPECT_THAT(Pose::from_matrix(m), is_near(X, 1e-14, 1e-15));
}

TEST(PoseDeathTest, FromMatrixOfAMirrorIsABug) {
  testing::FLAGS_gtest_death_test_style = "threadsafe";
  Eigen::Matrix4d mirror = Eigen::Matrix4d::Identity();
  mirror(0, 0) = -1.0;
  EXPECT_DEATH(Pose::from_matrix(mirror), "no rotation");
  EXPECT_DEATH(Pose::from_matrix(1.01 * Eigen::Matrix4d::Identity()), "no rotation");
  EXPECT_DEATH(Pose::from_matrix(Eigen::Matrix4d::Constant(std::nan(""))), "no rotation");
}

TEST(Pose, NormalizedHasUnitQuaternionWithPositiveW) {
  Pose X{Quaterniond(-0.2, 0.4, 0.6, -0.8), {1.0, 2.0, 3.0}};
  const Pose n = normalized(X);
  EXPECT_NEAR(n.rotation.norm(), 1.0, 1e-15);
  EXPECT_GT(n.rotation.w(), 0.0);
  EXPECT_NEAR(n.rotation.x() / n.rotation.w(), -2.0, 1e-15);
  EXPECT_EQ(n.translation, X.translation);
}

TEST(Pose, FiniteMeansAllNumbers) {
  Pose X;
  EXPECT_TRUE(X.is_finite());
  X.translation.y() = std::nan("");
  EXPECT_FALSE(X.is_finite());
  X = Pose();
  X.rotation.z() = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(X.is_finite());
}

TEST(Rotation, HalfTurnHasAngleOfPi) {
  EXPECT_DOUBLE_EQ(angle_between(Quaterniond::Identity(), Quaterniond(0, 0, 1, 0)), kPi);
  EXPECT_DOUBLE_EQ(angle_between(Quaterniond::Identity(), Quaterniond(-1, 0, 0, 0)), 0.0);
  EXPECT_THAT(log_rotation(exp_rotation({0.0, kPi, 0.0})).cwiseAbs().eval(), is_near(Vector3d(0.0, kPi, 0.0), 1e-15));
}

TEST(Rotation, SmallAnglesKeepTheirDigits) {
  for (const double angle : {1e-300, 1e-18, 1e-9, 1e-6, 0.999e-3, 1.001e-3}) {
    const Vector3d v = angle * Vector3d(1.0, -2.0, 2.0) / 3.0;
    EXPECT_THAT((log_rotation(exp_rotation(v)) / angle).eval(), is_near((v / angle).eval(), 1e-14)) << angle;
  }
}

TEST(Rotation, ExpMatchesEigensAngleAxis) {
  for (const double angle : {1e-5, 0.02, 0.7, 2.9, 5.0}) {
    const Vector3d axis = Vector3d(0.3, -0.5, 0.9).normalized();
    const Quaterniond expected(Eigen::AngleAxisd(angle, axis));
    EXPECT_THAT(exp_rotation(angle * axis).coeffs().eval(), is_near(expected.coeffs().eval(), 1e-15));
  }
}

TEST(BoxPlus, TurnsInTheBodyAndMovesInTheParent) {
  const Pose X{exp_rotation({0.0, 0.0, 0.5 * kPi}), {1.0, 0.0, 0.0}};
  Vector6d d;
  d << 0.5 * kPi, 0.0, 0.0, 0.0, 0.25, 0.0;
  const Pose moved = box_plus(X, d);
  EXPECT_THAT(moved.translation, is_near(Vector3d(1.0, 0.25, 0.0), 1e-15));
  // The body's z, turned about its x: -y of the body, which is x of the parent.
  EXPECT_THAT((moved.rotation * Vector3d::UnitZ()).eval(), is_near(Vector3d(1.0, 0.0, 0.0), 1e-15));
}

TEST(Interpolate, GoesTheShortWay) {
  const Pose a{exp_rotation({0.0, 0.0, 0.2}), {0.0, 0.0, 0.0}};
  Pose b{exp_rotation({0.0, 0.0, 0.6}), {1.0, 2.0, 4.0}};
  b.rotation.coeffs() *= -1.0;
  EXPECT_THAT(interpolate(a, b, 0.25), is_near(Pose{exp_rotation({0.0, 0.0, 0.3}), {0.25, 0.5, 1.0}}, 1e-15, 1e-15));
  EXPECT_THAT(interpolate(a, b, 0.0), is_near(a, 1e-15, 0.0));
  EXPECT_THAT(interpolate(a, b, 1.0), is_near(b, 1e-15, 0.0));
}

TEST(Twist, ShiftedAddsTheLeverArm) {
  const Twist V_WB{{0.0, 0.0, 2.0}, {1.0, 0.0, 0.0}};
  const Twist V_WQ = shifted(V_WB, {0.0, 0.5, 0.0});
  EXPECT_EQ(V_WQ.angular, V_WB.angular);
  EXPECT_THAT(V_WQ.linear, is_near(Vector3d(0.0, 0.0, 0.0), 1e-15));
  EXPECT_TRUE(V_WQ.is_finite());
}

TEST(Pose, PrintsPositionAndQuaternion) {
  EXPECT_EQ(to_string(Pose{Quaterniond(0.5, 0.5, -0.5, 0.5), {1.0, -0.25, 1e-7}}),
            "(1, -0.25, 1e-07) m, [0.5, 0.5, -0.5, 0.5]");
}

TEST(Plane, MovesWithItsFrame) {
  const Plane plane_B{Vector3d::UnitX(), -0.5};  // x = 0.5
  const Pose X_AB{exp_rotation({0.0, 0.0, 0.5 * kPi}), {10.0, 20.0, 30.0}};
  const Plane plane_A = transformed(plane_B, X_AB);
  EXPECT_THAT(plane_A.normal, is_near(Vector3d(0.0, 1.0, 0.0), 1e-15));
  EXPECT_NEAR(plane_A.signed_distance(X_AB * Vector3d(0.75, 3.0, 4.0)), 0.25, 1e-13);
}

}  // namespace
}  // namespace prescene::geometry
