// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <numbers>

#include "prescene/geometry/plane.h"
#include "prescene/geometry/pose.h"
#include "tests/support/generators.h"

namespace prescene::geometry {
namespace {

using tests::numbers;
using tests::pose_errors;
using tests::poses;
using tests::rotations;
using tests::vectors;

double distance(const Pose& a, const Pose& b) {
  return angle_between(a.rotation, b.rotation) + (a.translation - b.translation).norm();
}

TEST(PoseLaws, PosesAreAGroup) {
  EXPECT_TRUE(tests::check_law([] {
    const Pose a = *poses();
    const Pose b = *poses();
    const Pose c = *poses();
    RC_ASSERT(distance((a * b) * c, a * (b * c)) < 1e-13);
    RC_ASSERT(distance(a * a.inverse(), Pose::identity()) < 1e-13);
    RC_ASSERT(distance((a * b).inverse(), b.inverse() * a.inverse()) < 1e-13);
  }));
}

TEST(PoseLaws, ProductsActOnPointsLikeMatrices) {
  EXPECT_TRUE(tests::check_law([] {
    const Pose a = *poses();
    const Pose b = *poses();
    const Vector3d p = *vectors();
    RC_ASSERT(((a * b) * p - a * (b * p)).norm() < 1e-13);
    const Eigen::Vector4d h = a.matrix() * b.matrix() * p.homogeneous();
    RC_ASSERT((h.head<3>() - (a * b) * p).norm() < 1e-13);
    RC_ASSERT(distance(Pose::from_matrix(a.matrix()), a) < 1e-13);
  }));
}

TEST(PoseLaws, LogIsTheShortestRotationVector) {
  EXPECT_TRUE(tests::check_law([] {
    const Quaterniond q = *rotations();
    const Vector3d v = log_rotation(q);
    RC_ASSERT(v.norm() <= std::numbers::pi + 1e-15);
    RC_ASSERT(angle_between(exp_rotation(v), q) < 1e-14);
    const Quaterniond negated(-q.w(), -q.x(), -q.y(), -q.z());
    RC_ASSERT(angle_between(q, negated) < 1e-14);
  }));
}

TEST(PoseLaws, AnglesAreAMetricThatTurningKeeps) {
  EXPECT_TRUE(tests::check_law([] {
    const Quaterniond a = *rotations();
    const Quaterniond b = *rotations();
    const Quaterniond c = *rotations();
    RC_ASSERT(std::abs(angle_between(a, b) - angle_between(b, a)) < 1e-13);
    RC_ASSERT(angle_between(a, c) <= angle_between(a, b) + angle_between(b, c) + 1e-13);
    RC_ASSERT(std::abs(angle_between(c * a, c * b) - angle_between(a, b)) < 1e-13);
    RC_ASSERT(std::abs(angle_between(a * c, b * c) - angle_between(a, b)) < 1e-13);
  }));
}

TEST(PoseLaws, BoxMinusInvertsBoxPlus) {
  EXPECT_TRUE(tests::check_law([] {
    const Pose mean = *poses();
    const Vector6d d = *pose_errors();
    RC_ASSERT((box_minus(box_plus(mean, d), mean) - d).norm() < 1e-12);
    const Pose X = *poses();
    RC_ASSERT(distance(box_plus(mean, box_minus(X, mean)), X) < 1e-12);
  }));
}

TEST(PoseLaws, InterpolationMovesAtConstantSpeed) {
  EXPECT_TRUE(tests::check_law([] {
    const Pose a = *poses();
    const Pose b = *poses();
    const double t = *numbers(0.0, 1.0);
    const Pose X = interpolate(a, b, t);
    const double whole = angle_between(a.rotation, b.rotation);
    RC_ASSERT(std::abs(angle_between(a.rotation, X.rotation) - t * whole) < 1e-12);
    RC_ASSERT(std::abs((X.translation - a.translation).norm() - t * (b.translation - a.translation).norm()) < 1e-12);
  }));
}

TEST(PoseLaws, ShiftedTwistsAreThatOfPointsOfTheBody) {
  EXPECT_TRUE(tests::check_law([] {
    const Twist V{*vectors(), *vectors()};
    const Vector3d p = *vectors();
    const Vector3d q = *vectors();
    const Twist once = shifted(V, p + q);
    const Twist twice = shifted(shifted(V, p), q);
    RC_ASSERT((once.linear - twice.linear).norm() < 1e-13);
    // A small motion of the body moves the point at p like the shifted twist says.
    constexpr double kDt = 1e-6;
    const Vector3d moved = kDt * V.linear + exp_rotation(kDt * V.angular) * p - p;
    RC_ASSERT((moved / kDt - shifted(V, p).linear).norm() < 1e-4);
  }));
}

TEST(PoseLaws, DistanceToAPlaneDoesNotDependOnTheFrame) {
  EXPECT_TRUE(tests::check_law([] {
    const Plane plane_B{*tests::directions(), *numbers(-2.0, 2.0)};
    const Pose X_AB = *poses();
    const Vector3d p_B = *vectors();
    const Plane plane_A = transformed(plane_B, X_AB);
    RC_ASSERT(std::abs(plane_A.signed_distance(X_AB * p_B) - plane_B.signed_distance(p_B)) < 1e-13);
    RC_ASSERT(std::abs(plane_A.normal.norm() - 1.0) < 1e-14);
  }));
}

}  // namespace
}  // namespace prescene::geometry
