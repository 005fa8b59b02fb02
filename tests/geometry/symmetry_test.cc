// SPDX-License-Identifier: Apache-2.0
#include "prescene/geometry/symmetry.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "prescene/geometry/primitives.h"
#include "prescene/geometry/sampling.h"
#include "tests/support/generators.h"
#include "tests/support/matchers.h"

namespace prescene::geometry::symmetry_test {
namespace {

using tests::is_near;
using tests::poses;

constexpr double kPi = std::numbers::pi;

const Vector3d kCentre(0.02, -0.01, 0.05);

std::vector<SymmetryGroup> groups() {
  const Vector3d axis = Vector3d(0.3, -0.6, 0.9).normalized();
  return {SymmetryGroup::none(),
          SymmetryGroup::cyclic(axis, 2, kCentre),
          SymmetryGroup::cyclic(axis, 5, kCentre),
          SymmetryGroup::continuous(axis, false, kCentre),
          SymmetryGroup::continuous(axis, true, kCentre),
          SymmetryGroup::cuboid(kCentre),
          SymmetryGroup::cube(kCentre),
          SymmetryGroup::every_rotation(kCentre)};
}

// A random member of the group, as a motion of the body.
Pose member(const SymmetryGroup& group, core::RandomStream& stream) {
  Quaterniond r = Quaterniond::Identity();
  if (group.ball) r = uniform_rotation(stream);
  if (const std::size_t pick = stream.uniform_below(group.rotations.size() + 1); pick > 0)
    r = group.rotations[pick - 1];
  if (group.axis) r = r * exp_rotation(stream.uniform(0.0, 2.0 * kPi) * *group.axis);
  return {r, group.p_BoC - r * group.p_BoC};
}

TEST(Symmetry, OfACubeAreTheRotationsThatPermuteTheAxes) {
  const SymmetryGroup cube = SymmetryGroup::cube();
  ASSERT_EQ(cube.rotations.size(), 23u);
  std::vector<Quaterniond> all = cube.rotations;
  all.push_back(Quaterniond::Identity());
  for (std::size_t i = 0; i < all.size(); ++i) {
    const geometry::Matrix3d R = all[i].toRotationMatrix();
    // Entries are 0 and +-1: each axis goes to an axis.
    EXPECT_LT((R.cwiseAbs() - R.cwiseAbs().array().round().matrix()).norm(), 1e-12) << i;
    for (std::size_t j = 0; j < i; ++j) EXPECT_GT(angle_between(all[i], all[j]), 1.0) << i << " " << j;
  }
}

TEST(SymmetryLaws, EquivalentPosesAreAtAngleZero) {
  for (const SymmetryGroup& group : groups()) {
    EXPECT_TRUE(tests::check_law([&](std::uint64_t seed) {
      core::RandomStream stream(seed, core::Purpose::kTest);
      const Pose X = *poses();
      const Pose Y = *poses();
      const Pose s = member(group, stream);
      RC_ASSERT(symmetric_angle(X * s, X, group) < 1e-7);
      // The angle to anything else does not change either, from both sides.
      RC_ASSERT(std::abs(symmetric_angle(X * s, Y, group) - symmetric_angle(X, Y, group)) < 1e-7);
      RC_ASSERT(std::abs(symmetric_angle(X, Y * s, group) - symmetric_angle(X, Y, group)) < 1e-7);
      RC_ASSERT(std::abs(symmetric_angle(Y, X, group) - symmetric_angle(X, Y, group)) < 1e-7);
      RC_ASSERT(symmetric_angle(X, Y, group) <= angle_between(X.rotation, Y.rotation) + 1e-9);
    }));
  }
}

TEST(SymmetryLaws, ClosestEquivalentIsClosestAndKeepsTheCentre) {
  for (const SymmetryGroup& group : groups()) {
    EXPECT_TRUE(tests::check_law([&](std::uint64_t seed) {
      core::RandomStream stream(seed, core::Purpose::kTest);
      const Pose X = *poses();
      const Pose R = *poses();
      const Pose best = closest_equivalent(X, R, group);
      RC_ASSERT((best * group.p_BoC - X * group.p_BoC).norm() < 1e-12);
      RC_ASSERT(symmetric_angle(best, X, group) < 1e-7);
      for (int i = 0; i < 10; ++i) {
        const Pose other = X * member(group, stream);
        RC_ASSERT(angle_between(best.rotation, R.rotation) <= angle_between(other.rotation, R.rotation) + 1e-9);
      }
    }));
  }
}

TEST(SymmetryGroup, NoneChangesNothing) {
  const Pose X{exp_rotation({0.1, 0.2, 0.3}), {1.0, 2.0, 3.0}};
  EXPECT_EQ(closest_equivalent(X, Pose(), SymmetryGroup::none()), X);
  EXPECT_TRUE(SymmetryGroup::none().trivial());
  EXPECT_TRUE(SymmetryGroup::cyclic(Vector3d::UnitX(), 1).trivial());
  EXPECT_FALSE(SymmetryGroup::every_rotation().trivial());
}

TEST(SymmetryGroup, QuarterTurnsLeaveAtMostAnEighth) {
  const SymmetryGroup group = SymmetryGroup::cyclic(Vector3d::UnitZ(), 4);
  for (const double angle : {0.1, 1.0, 2.5, 4.0, 6.0}) {
    const double expected = std::abs(std::remainder(angle, 0.5 * kPi));
    EXPECT_NEAR(symmetric_angle(Pose{exp_rotation({0.0, 0.0, angle}), {}}, Pose(), group), expected, 1e-12);
  }
}

TEST(SymmetryGroup, ContinuousLeavesTheTiltOfTheAxis) {
  const SymmetryGroup one_way = SymmetryGroup::continuous(Vector3d::UnitZ(), false);
  const SymmetryGroup both_ways = SymmetryGroup::continuous(Vector3d::UnitZ(), true);
  const Pose X{exp_rotation({0.0, 2.5, 0.0}) * exp_rotation({0.0, 0.0, 1.3}), {}};
  EXPECT_NEAR(symmetric_angle(X, Pose(), one_way), 2.5, 1e-12);
  EXPECT_NEAR(symmetric_angle(X, Pose(), both_ways), kPi - 2.5, 1e-12);
}

TEST(SymmetryGroup, ComparesByValue) {
  EXPECT_EQ(SymmetryGroup::cuboid(), SymmetryGroup::cuboid());
  EXPECT_FALSE(SymmetryGroup::cuboid() == SymmetryGroup::cuboid(kCentre));
  EXPECT_FALSE(SymmetryGroup::cuboid() == SymmetryGroup::none());
  EXPECT_FALSE(SymmetryGroup::continuous(Vector3d::UnitZ(), false) ==
               SymmetryGroup::continuous(Vector3d::UnitX(), false));
}

// Suggested for a mesh in a pose that is no simple one, so that only the principal axes can help.
SymmetryGroup suggested(const TriangleMesh& mesh, bool turned) {
  const Pose X =
      turned ? Pose{exp_rotation({0.4, -0.9, 0.3}), {0.3, 0.1, -0.2}} : Pose::from_translation({0.3, 0.1, -0.2});
  return suggest_symmetry(transformed(mesh, X), 1e-3);
}

TEST(SuggestSymmetry, BoxOfThreeEdges) {
  for (const bool turned : {false, true}) {
    const SymmetryGroup group = suggested(make_mesh(BoxShape{{0.1, 0.2, 0.3}}), turned);
    EXPECT_EQ(group.rotations.size(), 3U);
    EXPECT_FALSE(group.axis.has_value());
    EXPECT_THAT(group.p_BoC, is_near(Vector3d(0.3, 0.1, -0.2), 1e-12));
  }
}

TEST(SuggestSymmetry, SquarePrism) {
  // Four turns about its axis, each with or without a flip.
  for (const bool turned : {false, true}) {
    EXPECT_EQ(suggested(make_mesh(BoxShape{{0.1, 0.1, 0.3}}), turned).rotations.size(), 7U);
  }
}

TEST(SuggestSymmetry, Cube) { EXPECT_EQ(suggested(make_mesh(BoxShape{{0.1, 0.1, 0.1}}), false).rotations.size(), 23U); }

TEST(SuggestSymmetry, Bin) {
  const SymmetryGroup group = suggested(make_open_bin({0.4, 0.3, 0.2}, 0.02), false);
  ASSERT_EQ(group.rotations.size(), 1U);
  EXPECT_NEAR(std::abs(group.rotations[0].z()), 1.0, 1e-9);
}

TEST(SuggestSymmetry, HexagonalPyramid) {
  const TriangleMesh pyramid = make_lathe({{0.1, 0.0}, {0.0, 0.2}}, 6);
  for (const bool turned : {false, true}) EXPECT_EQ(suggested(pyramid, turned).rotations.size(), 5U);
}

TEST(SuggestSymmetry, BodiesOfRevolution) {
  for (const bool turned : {false, true}) {
    const SymmetryGroup can = suggested(make_mesh(Cylinder{0.03, 0.1}, 64), turned);
    ASSERT_TRUE(can.axis.has_value());
    EXPECT_EQ(can.rotations.size(), 1U);
    const SymmetryGroup cone = suggested(make_mesh(Cone{0.03, 0.1}, 64), turned);
    ASSERT_TRUE(cone.axis.has_value());
    EXPECT_TRUE(cone.rotations.empty());
    EXPECT_FALSE(cone.ball);
  }
  const SymmetryGroup can = suggested(make_mesh(Cylinder{0.03, 0.1}, 64), false);
  EXPECT_THAT(can.axis->cwiseAbs().eval(), is_near(Vector3d::UnitZ().eval(), 1e-12));
}

TEST(SuggestSymmetry, Ball) { EXPECT_TRUE(suggested(make_mesh(Sphere{0.05}, 64), true).ball); }

TEST(SuggestSymmetry, AHandleTakesTheAxisAway) {
  const TriangleMesh cup = make_mesh(Cylinder{0.04, 0.1}, 64);
  const TriangleMesh handle =
      transformed(make_mesh(BoxShape{{0.03, 0.01, 0.06}}), Pose::from_translation({0.055, 0, 0}));
  const SymmetryGroup group = suggested(joined(cup, handle), false);
  EXPECT_FALSE(group.axis.has_value());
  // What is left is the half turn about the handle's direction.
  EXPECT_EQ(group.rotations.size(), 1U);
}

TEST(SuggestSymmetry, OpenMeshesAreJudgedByTheirSurface) {
  TriangleMesh tube = make_mesh(Cylinder{0.03, 0.1}, 64);
  tube.triangles.erase(tube.triangles.begin(), tube.triangles.begin() + 64);  // Without its bottom.
  const SymmetryGroup group = suggested(tube, false);
  EXPECT_TRUE(group.axis.has_value());
  EXPECT_TRUE(suggest_symmetry(TriangleMesh{}, 1e-3).trivial());
}

}  // namespace
}  // namespace prescene::geometry::symmetry_test
