// SPDX-License-Identifier: Apache-2.0
// Where objects can be, against closed forms for boxes and an open bin.
#include <gtest/gtest.h>

#include "filter_fixture.h"
#include "prescene/filter/proposals/support_surfaces.h"
#include "prescene/geometry/sampling.h"

namespace prescene::filter_tests {
namespace {

constexpr double kInner = 0.18, kHeight = 0.25, kWall = 0.005;

belief::Scene bin_on_table() {
  belief::Scene scene;
  scene.supports.push_back(table());
  belief::Support bin;
  bin.name = "bin";
  bin.visual =
      std::make_shared<const geometry::TriangleMesh>(geometry::make_open_bin({kInner, kInner, kHeight}, kWall));
  scene.supports.push_back(bin);
  return scene;
}

TEST(SupportSurfaces, InsideABoxIsInside) {
  MeshCache meshes;
  belief::Scene scene;
  scene.supports.push_back(table());
  scene.supports[0].X_WS = Pose{geometry::exp_rotation({0.3, -0.2, 1.0}), {0.2, 0.1, -0.4}};
  const SupportSurfaces surfaces(scene, meshes);
  core::RandomStream stream(5, core::Purpose::kTest);
  int inside = 0;
  for (int i = 0; i < 4000; ++i) {
    const double z = stream.uniform(-0.08, 0.04), y = stream.uniform(-0.7, 0.7), x = stream.uniform(-0.7, 0.7);
    const Vector3d p(x, y, z);
    const bool expected = std::abs(p.x()) < 0.5 && std::abs(p.y()) < 0.5 && p.z() > -0.04 && p.z() < 0.0;
    EXPECT_EQ(surfaces.inside(scene.supports[0].X_WS * p), expected) << p.transpose();
    inside += expected;
  }
  EXPECT_GT(inside, 300);
}

// The lengths of whose sides are small whole numbers.
TEST(SupportSurfaces, TheMiddleOfABoxIsInside) {
  for (int x = 1; x <= 9; ++x)
    for (int y = 1; y <= 9; ++y)
      for (int z = 1; z <= 9; ++z) {
        SupportSurfaces surfaces;
        const auto box = rendering::make_render_mesh(geometry::make_mesh(geometry::BoxShape{0.02 * Vector3d(x, y, z)}));
        surfaces.add(*box, Pose::identity());
        EXPECT_TRUE(surfaces.inside(Vector3d::Zero())) << x << y << z;
      }
}

TEST(SupportSurfaces, ASegmentCrossesAPlateIffItsEndsLieOnBothSides) {
  MeshCache meshes;
  belief::Scene scene;
  scene.supports.push_back(table());  // top at z = 0, 1 m x 1 m
  const SupportSurfaces surfaces(scene, meshes);
  core::RandomStream stream(6, core::Purpose::kTest);
  for (int i = 0; i < 2000; ++i) {
    const double p_z = stream.uniform(0.001, 0.3), p_y = stream.uniform(-0.4, 0.4), p_x = stream.uniform(-0.4, 0.4);
    const Vector3d p(p_x, p_y, p_z);
    const double q_z = stream.uniform(-0.3, 0.3), q_y = stream.uniform(-0.4, 0.4), q_x = stream.uniform(-0.4, 0.4);
    const Vector3d q(q_x, q_y, q_z);
    EXPECT_EQ(surfaces.crosses(p, q), q.z() < 0.0);
  }
}

TEST(SupportSurfaces, WhatStandsInABinIsFreeAndWhatSticksInItsWallIsNot) {
  MeshCache meshes;
  const belief::Scene scene = bin_on_table();
  const SupportSurfaces surfaces(scene, meshes);
  const auto box = rendering::make_render_mesh(geometry::make_mesh(geometry::BoxShape{Vector3d(0.07, 0.07, 0.2)}));
  const double tolerance = 0.01;
  EXPECT_EQ(surfaces.overlap(*box, Pose::from_translation({0.05, 0.0, kWall + 0.1}), tolerance), 0.0);
  EXPECT_EQ(surfaces.overlap(*box, Pose::from_translation({0.4, 0.0, 0.1}), tolerance), 0.0);
  // Touching, or as far in as the tolerance allows.
  EXPECT_EQ(surfaces.overlap(*box, Pose::from_translation({0.5 * kInner - 0.035 + 0.004, 0.0, 0.11}), tolerance), 0.0);
  EXPECT_GE(surfaces.overlap(*box, Pose::from_translation({0.5 * kInner, 0.0, 0.11}), tolerance), 0.5);
  EXPECT_GE(surfaces.overlap(*box, Pose::from_translation({0.0, 0.0, 0.03}), tolerance), 0.5);
  EXPECT_EQ(surfaces.overlap(*box, Pose::from_translation({0.4, 0.0, -0.02}), tolerance), 1.0);
}

TEST(SupportSurfaces, WhatABodyIsInTheWayOfMovesWithIt) {
  MeshCache meshes;
  const auto box = rendering::make_render_mesh(geometry::make_mesh(geometry::BoxShape{Vector3d(0.07, 0.05, 0.2)}));
  const SupportSurfaces in_own_frame(bin_on_table(), meshes);
  core::RandomStream stream(7, core::Purpose::kTest);
  const auto random_pose = [&stream] {
    const double z = stream.uniform(-1.0, 1.0), y = stream.uniform(-1.0, 1.0), x = stream.uniform(-1.0, 1.0);
    const Vector3d turn(x, y, z);
    return Pose{geometry::exp_rotation(turn),
                {stream.uniform(-0.2, 0.2), stream.uniform(-0.2, 0.2), stream.uniform(-0.1, 0.3)}};
  };
  int partly = 0;
  for (int i = 0; i < 300; ++i) {
    const Pose X_WB = random_pose(), X_BO = random_pose();
    SupportSurfaces surfaces;
    surfaces.place(in_own_frame, X_WB);
    const double overlap = in_own_frame.overlap(*box, X_BO, 0.01);
    EXPECT_EQ(surfaces.overlap(*box, X_WB * X_BO, 0.01), overlap);
    EXPECT_EQ(surfaces.inside(X_WB * X_BO.translation), in_own_frame.inside(X_BO.translation));
    partly += overlap > 0.0 && overlap < 1.0;
  }
  EXPECT_GT(partly, 50);
}

TEST(SupportSurfaces, NothingIsInTheWayWhereThereIsNoSupport) {
  MeshCache meshes;
  const SupportSurfaces surfaces(belief::Scene{}, meshes);
  EXPECT_TRUE(surfaces.empty());
  EXPECT_FALSE(surfaces.inside(Vector3d::Zero()));
  const auto box = rendering::make_render_mesh(geometry::make_mesh(geometry::BoxShape{Vector3d(1.0, 1.0, 1.0)}));
  EXPECT_EQ(surfaces.overlap(*box, Pose::identity(), 0.0), 0.0);
}

}  // namespace
}  // namespace prescene::filter_tests
