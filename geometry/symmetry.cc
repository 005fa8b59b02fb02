// SPDX-License-Identifier: Apache-2.0
#include "prescene/geometry/symmetry.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "prescene/core/check.h"

namespace prescene::geometry {
namespace {

Quaterniond turn(const Vector3d& axis, double angle) { return exp_rotation(angle * axis); }

// The symmetry's motion of the body: a rotation that keeps the point C.
Pose about_point(const Quaterniond& rotation, const Vector3d& p_BoC) { return {rotation, p_BoC - rotation * p_BoC}; }

}  // namespace

SymmetryGroup SymmetryGroup::cyclic(const Vector3d& axis, int n, const Vector3d& p_BoC) {
  PRESCENE_CHECK(n >= 1 && axis.norm() > 0.0);
  SymmetryGroup group;
  for (int k = 1; k < n; ++k) group.rotations.push_back(turn(axis.normalized(), 2.0 * std::numbers::pi * k / n));
  group.p_BoC = p_BoC;
  return group;
}

SymmetryGroup SymmetryGroup::continuous(const Vector3d& axis, bool flip, const Vector3d& p_BoC) {
  PRESCENE_CHECK(axis.norm() > 0.0);
  SymmetryGroup group;
  group.axis = axis.normalized();
  // One half turn about any perpendicular axis makes all of them together with the turns about the axis.
  if (flip) group.rotations.push_back(turn(group.axis->unitOrthogonal(), std::numbers::pi));
  group.p_BoC = p_BoC;
  return group;
}

SymmetryGroup SymmetryGroup::cuboid(const Vector3d& p_BoC) {
  SymmetryGroup group;
  group.rotations = {Quaterniond(0, 1, 0, 0), Quaterniond(0, 0, 1, 0), Quaterniond(0, 0, 0, 1)};
  group.p_BoC = p_BoC;
  return group;
}

SymmetryGroup SymmetryGroup::cube(const Vector3d& p_BoC) {
  SymmetryGroup group;
  group.p_BoC = p_BoC;
  const double half = std::sqrt(0.5);
  // Quarter and half turns about x, y and z, ...
  for (int axis = 0; axis < 3; ++axis)
    for (const auto& [w, v] : {std::pair(half, half), std::pair(0.0, 1.0), std::pair(half, -half)}) {
      Quaterniond turn_about(w, 0.0, 0.0, 0.0);
      turn_about.vec()[axis] = v;
      group.rotations.push_back(turn_about);
    }
  // ... third turns about the diagonals of the cube, ...
  for (const double x : {0.5, -0.5})
    for (const double y : {0.5, -0.5})
      for (const double z : {0.5, -0.5}) group.rotations.emplace_back(0.5, x, y, z);
  // ... and half turns about those of its faces.
  for (const double sign : {1.0, -1.0}) {
    group.rotations.emplace_back(0.0, half, sign * half, 0.0);
    group.rotations.emplace_back(0.0, half, 0.0, sign * half);
    group.rotations.emplace_back(0.0, 0.0, half, sign * half);
  }
  return group;
}

SymmetryGroup SymmetryGroup::every_rotation(const Vector3d& p_BoC) {
  SymmetryGroup group;
  group.ball = true;
  group.p_BoC = p_BoC;
  return group;
}

bool operator==(const SymmetryGroup& a, const SymmetryGroup& b) {
  const auto same = [](const Quaterniond& p, const Quaterniond& q) { return p.coeffs() == q.coeffs(); };
  return a.axis == b.axis && a.ball == b.ball && a.p_BoC == b.p_BoC &&
         std::equal(a.rotations.begin(), a.rotations.end(), b.rotations.begin(), b.rotations.end(), same);
}

Pose closest_equivalent(const Pose& X_WB, const Pose& X_WR, const SymmetryGroup& group) {
  const Quaterniond wanted = X_WB.rotation.conjugate() * X_WR.rotation;  // The best S, were it in the group.
  if (group.ball) return X_WB * about_point(wanted, group.p_BoC);

  Quaterniond best = Quaterniond::Identity();
  double best_cosine = -1.0;  // Of half the angle that is left.
  const auto try_rotation = [&](const Quaterniond& rotation) {
    const Quaterniond left = rotation.conjugate() * wanted;
    if (!group.axis) {
      if (std::abs(left.w()) > best_cosine) {
        best_cosine = std::abs(left.w());
        best = rotation;
      }
      return;
    }
    // Of the turns about the axis the one of half angle h with the largest w cos h + (v . axis) sin h.
    const double along = left.vec().dot(*group.axis);
    const double cosine = std::hypot(left.w(), along);
    if (cosine > best_cosine) {
      best_cosine = cosine;
      best = rotation * turn(*group.axis, 2.0 * std::atan2(along, left.w()));
    }
  };
  try_rotation(Quaterniond::Identity());
  for (const Quaterniond& rotation : group.rotations) try_rotation(rotation);
  return X_WB * about_point(best, group.p_BoC);
}

double symmetric_angle(const Pose& X_a, const Pose& X_b, const SymmetryGroup& group) {
  return angle_between(closest_equivalent(X_a, X_b, group).rotation, X_b.rotation);
}

}  // namespace prescene::geometry
