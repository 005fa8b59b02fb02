// SPDX-License-Identifier: Apache-2.0
// Heights that ways out pass: of faces, by hand, and of containers, by geometry.
#include <gtest/gtest.h>

#include <cmath>

#include "prescene/geometry/primitives.h"
#include "prescene/simulation/outcomes/face_trap.h"
#include "prescene/simulation/outcomes/spill_levels.h"

namespace prescene::simulation {
namespace {

using geometry::Box;
using geometry::BoxShape;
using geometry::TriangleMesh;

ConvexPolytope hull_of(const geometry::Primitive& shape) { return *make_polytope(geometry::make_mesh(shape).vertices); }

TEST(FaceTrap, ABoxTipsOverItsNearestEdge) {
  const ConvexPolytope box = hull_of(BoxShape{{0.10, 0.08, 0.06}});
  const Pose standing = Pose::from_translation({0.0, 0.0, 0.03});
  const auto trap = trap_of(box, standing, Vector3d::Zero(), {0.0, 1.0}, 0.0);
  ASSERT_TRUE(trap);
  EXPECT_NEAR(trap->barrier, std::hypot(0.03, 0.04), 1e-12);
  EXPECT_NEAR(trap->lowest, 0.03, 1e-12);
  EXPECT_NEAR(trap->face_normal_O.z(), -1.0, 1e-12);
  EXPECT_NEAR(trap->tilt(0.03), 0.0, 1e-7);
  EXPECT_NEAR(trap->tilt(trap->barrier), std::atan2(0.04, 0.03), 1e-7);
  const double angle = 0.3;
  EXPECT_NEAR(trap->tilt(0.03 * std::cos(angle) + 0.04 * std::sin(angle)), angle, 1e-9);

  // The support ends 1 cm from below the centre; the centre is 2 cm off; the edges are round.
  EXPECT_NEAR(trap_of(box, standing, Vector3d::Zero(), {0.0, 0.01}, 0.0)->barrier, std::hypot(0.03, 0.01), 1e-12);
  EXPECT_NEAR(trap_of(box, standing, {0.0, 0.02, 0.0}, {0.0, 1.0}, 0.0)->barrier, std::hypot(0.03, 0.02), 1e-12);
  EXPECT_NEAR(trap_of(box, standing, Vector3d::Zero(), {0.0, 1.0}, 0.005)->barrier, std::hypot(0.025, 0.035) + 0.005,
              1e-12);
  EXPECT_FALSE(trap_of(box, standing, Vector3d::Zero(), {0.0, -0.01}, 0.0));
  EXPECT_FALSE(trap_of(box, standing, Vector3d::Zero(), {0.01, 1.0}, 0.0));  // it reaches below the plane
}

TEST(FaceTrap, TheFaceBelowChangesWhereTheCentrePassesTheEdge) {
  const ConvexPolytope box = hull_of(BoxShape{{0.10, 0.08, 0.06}});
  const double over = std::atan2(0.04, 0.03);
  for (const double more : {-0.01, 0.01}) {
    const Pose tilted{geometry::exp_rotation({over + more, 0.0, 0.0}), {0.0, 0.0, 0.06}};
    const auto trap = trap_of(box, tilted, Vector3d::Zero(), {0.0, 1.0}, 0.0);
    ASSERT_TRUE(trap);
    EXPECT_NEAR(trap->lowest, more < 0.0 ? 0.03 : 0.04, 1e-12);
  }
}

TEST(FaceTrap, WhatRollsHasHardlyABarrier) {
  const Pose lying{geometry::exp_rotation({1.5707963267948966, 0.0, 0.0}), {0.0, 0.0, 0.036}};
  const auto trap = trap_of(hull_of(geometry::Cylinder{0.035, 0.24}), lying, Vector3d::Zero(), {0.0, 1.0}, 0.0);
  const double rise = trap ? trap->barrier - trap->lowest : 0.0;
  EXPECT_LT(rise, 5e-4);
}

TEST(UprightHeight, IsReachedByNoOrientation) {
  const Vector3d center(0.005, -0.003, 0.01);
  for (const geometry::Primitive& shape :
       {geometry::Primitive(geometry::Cylinder{0.035, 0.24}), geometry::Primitive(BoxShape{{0.10, 0.08, 0.06}})}) {
    const ConvexPolytope hull = hull_of(shape);
    for (const double angle : {0.0, 0.1, 0.35, 1.0}) {
      const Vector3d up = Vector3d(0.1, 0.2, 1.0).normalized();
      const double bound = least_upright_height(hull, center, up, angle);
      double least = std::numeric_limits<double>::infinity();
      const Vector3d across = up.unitOrthogonal();
      for (int i = 0; i < 72; ++i) {
        const Vector3d around = Eigen::AngleAxisd(i * 0.0872665, up) * across;
        for (int k = 0; k <= 20; ++k) {
          const Vector3d down = -(Eigen::AngleAxisd(angle * k / 20.0, around) * up);
          double height = -std::numeric_limits<double>::infinity();
          for (const Vector3d& v : hull.vertices) height = std::max(height, down.dot(v - center));
          least = std::min(least, height);
        }
      }
      EXPECT_LE(bound, least + 1e-12) << angle;
      if (angle < 0.5) {
        EXPECT_GE(bound, 0.6 * least) << angle;
      }
    }
  }
}

/// Levels of leaving the hollow of an open bin of 18 cm inner width and 24 cm depth, whose rim is at 25 cm.
SpillLevels leaving(const std::vector<TriangleMesh>& surfaces, double radius) {
  const auto outside = [](const Vector3d& low, const Vector3d& high) {
    return (high.array() > Eigen::Array3d(0.09, 0.09, 0.25)).any() ||
           (low.array() < Eigen::Array3d(-0.09, -0.09, 0.01)).any();
  };
  return {surfaces, Box(Vector3d(-0.16, -0.16, -0.06), Vector3d(0.16, 0.16, 0.32)), {radius}, outside, true};
}

TEST(SpillLevels, ABinSpillsOverItsRim) {
  const TriangleMesh bin = geometry::make_open_bin({0.18, 0.18, 0.24}, 0.01);
  const double radius = 0.035;
  const SpillLevels levels = leaving({bin}, radius);
  for (const double z : {0.06, 0.15, 0.22}) {
    // The region begins above the hollow.
    EXPECT_LE(levels.level({0.0, 0.0, z}), 0.25);
    EXPECT_GT(levels.level({0.0, 0.0, z}), 0.25 - 2.0 * radius / 3.0);
  }
  EXPECT_EQ(levels.level({0.0, 0.0, 0.30}), -std::numeric_limits<double>::infinity());
  EXPECT_EQ(levels.level({0.5, 0.0, 0.10}), -std::numeric_limits<double>::infinity());
  EXPECT_EQ(levels.level({0.095, 0.0, 0.10}), -std::numeric_limits<double>::infinity());  // in the wall
}

TEST(SpillLevels, GettingInTakesTheBallOverTheRim) {
  const TriangleMesh bin = geometry::make_open_bin({0.18, 0.18, 0.24}, 0.01);
  const auto inside = [](const Vector3d& low, const Vector3d& high) {
    return (low.cwiseAbs().cwiseMin(high.cwiseAbs()).array().head<2>() < 0.09).all() && low.z() < 0.25 &&
           high.z() > 0.03;
  };
  const double radius = 0.035;
  const SpillLevels levels({bin}, Box(Vector3d(-0.16, -0.16, -0.06), Vector3d(0.16, 0.16, 0.32)), {radius}, inside,
                           false);
  for (const Vector3d& p : {Vector3d(0.14, 0.0, 0.05), Vector3d(0.0, -0.15, 0.20), Vector3d(2.0, 1.0, 0.0)}) {
    EXPECT_GT(levels.level(p), 0.25);
    EXPECT_LE(levels.level(p), 0.25 + radius);
  }
}

TEST(SpillLevels, AWindowInTheWallLowersTheSill) {
  // Five walls of which one has a window from 8 to 20 cm, 12 cm wide.
  const auto wall = [](const Vector3d& size, const Vector3d& center) {
    return geometry::transformed(geometry::make_mesh(BoxShape{size}), Pose::from_translation(center));
  };
  const std::vector<TriangleMesh> walls = {
      wall({0.20, 0.20, 0.01}, {0.0, 0.0, 0.005}),    wall({0.01, 0.20, 0.25}, {-0.095, 0.0, 0.125}),
      wall({0.20, 0.01, 0.25}, {0.0, 0.095, 0.125}),  wall({0.20, 0.01, 0.25}, {0.0, -0.095, 0.125}),
      wall({0.01, 0.20, 0.08}, {0.095, 0.0, 0.04}),   wall({0.01, 0.20, 0.05}, {0.095, 0.0, 0.225}),
      wall({0.01, 0.04, 0.25}, {0.095, 0.08, 0.125}), wall({0.01, 0.04, 0.25}, {0.095, -0.08, 0.125})};
  const double small = leaving(walls, 0.02).level({0.0, 0.0, 0.05});
  EXPECT_GT(small, 0.07);
  EXPECT_LE(small, 0.08 + 0.02);
  // A ball that does not fit through it has to go over the rim.
  EXPECT_GT(leaving(walls, 0.085).level({0.0, 0.0, 0.12}), 0.18);
}

}  // namespace
}  // namespace prescene::simulation
