// SPDX-License-Identifier: Apache-2.0
#include "prescene/geometry/resting_poses.h"

#include <gtest/gtest.h>

#include <cmath>

#include "prescene/core/random.h"
#include "prescene/geometry/mass_properties.h"
#include "prescene/geometry/primitives.h"
#include "prescene/geometry/sampling.h"

namespace prescene::geometry {
namespace {

double sum(const std::vector<RestingPose>& poses) {
  double total = 0.0;
  for (const RestingPose& pose : poses) total += pose.probability;
  return total;
}

TEST(RestingPoses, ABoxLiesOnItsSixFaces) {
  const auto poses = resting_poses(make_mesh(BoxShape{{0.2, 0.1, 0.05}}), Vector3d::Zero());
  ASSERT_TRUE(poses.ok());
  ASSERT_EQ(poses->size(), 6u);
  EXPECT_NEAR(sum(*poses), 1.0, 1e-12);
  // The large faces are seen under the largest solid angle, 4 atan(ab / (c d)) with half edges a, b, distance c.
  const double a = 0.1, b = 0.05, c = 0.025;
  const double angle = 4.0 * std::atan(a * b / (c * std::sqrt(a * a + b * b + c * c)));
  EXPECT_NEAR(poses->front().probability, angle / (4.0 * M_PI), 1e-12);
  EXPECT_NEAR(poses->front().height, 0.025, 1e-12);
  EXPECT_NEAR(poses->front().tip_angle, std::atan(0.05 / 0.025), 1e-12);
  const Vector3d down = poses->front().R_WB * Vector3d::UnitZ();
  EXPECT_NEAR(std::abs(down.z()), 1.0, 1e-12);
}

TEST(RestingPoses, AnOffCentreMassRollsOffTheFarFaces) {
  // The mass sits so near to one end that the body can't stand on the other end's slanted sides; it always has a way to
  // lie.
  const TriangleMesh cone = make_mesh(Cone{0.05, 0.2}, 24);
  const MassProperties mass = *mass_properties(cone, 1000.0);
  const auto poses = resting_poses(cone, mass.p_BoBcm);
  ASSERT_TRUE(poses.ok());
  EXPECT_NEAR(sum(*poses), 1.0, 1e-9);
  int bases = 0;
  for (const RestingPose& pose : *poses) {
    if (std::abs(pose.height - 0.05) > 1e-6) continue;
    ++bases;  // the centre of mass of a cone is a quarter of its length above its base
    EXPECT_NEAR(pose.tip_angle, std::atan(0.05 * std::cos(M_PI / 24) / 0.05), 1e-6);
  }
  EXPECT_EQ(bases, 1);
}

TEST(RestingPoses, AThinStickDoesNotStandOnASlantedEnd) {
  TriangleMesh stick = make_mesh(BoxShape{{0.02, 0.02, 0.3}});
  for (Vector3d& vertex : stick.vertices) {
    if (vertex.z() > 0.0)
      vertex.x() += 0.2;  // a sheared box: its ends are level, but the middle is far off to the side
  }
  const auto poses = resting_poses(stick, Vector3d(0.1, 0.0, 0.0));
  ASSERT_TRUE(poses.ok());
  EXPECT_EQ(poses->size(), 4u);
  EXPECT_NEAR(sum(*poses), 1.0, 1e-9);
}

TEST(RestingPoses, OfRoundedBodiesTakeUpEveryRotation) {
  // Cut into many small facets that are merged generously: a body may not roll in circles among them and be lost.
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    core::RandomStream stream(seed, core::Purpose::kTest);
    TriangleMesh pebble;
    for (int i = 0; i < 400; ++i) {
      const Vector3d direction = uniform_direction(stream);
      pebble.vertices.push_back(direction.cwiseProduct(Vector3d(0.03, 0.045, 0.1)));
    }
    for (const double flatness : {0.02, 0.1, 0.3}) {
      const auto poses = resting_poses(pebble, Vector3d(0.0, 0.002, 0.005), flatness);
      ASSERT_TRUE(poses.ok()) << poses.status().message();
      EXPECT_NEAR(sum(*poses), 1.0, 1e-9) << "seed " << seed << ", flatness " << flatness;
      for (const RestingPose& pose : *poses) EXPECT_GE(pose.tip_angle, 0.0);
    }
  }
}

TEST(RestingPoses, DoNotDependOnTheBodyFrame) {
  const TriangleMesh box = make_mesh(BoxShape{{0.2, 0.1, 0.05}});
  const Pose X_NB{exp_rotation({0.4, -1.1, 0.7}), {0.3, 0.2, -0.1}};
  const auto here = resting_poses(box, {0.02, 0.01, 0.0});
  const auto there = resting_poses(transformed(box, X_NB), X_NB * Vector3d(0.02, 0.01, 0.0));
  ASSERT_TRUE(here.ok() && there.ok());
  ASSERT_EQ(here->size(), there->size());
  for (std::size_t i = 0; i < here->size(); ++i) {
    EXPECT_NEAR((*here)[i].probability, (*there)[i].probability, 1e-9);
    EXPECT_NEAR((*here)[i].height, (*there)[i].height, 1e-9);
  }
}

TEST(RestingPoses, RefusesACentreOfMassOutside) {
  EXPECT_EQ(resting_poses(make_mesh(BoxShape{{0.1, 0.1, 0.1}}), Vector3d(0.2, 0.0, 0.0)).status().code(),
            core::StatusCode::kInvalidInput);
}

TEST(FaceUp, NamesTheFaceThatPointsUp) {
  EXPECT_EQ(face_up(Quaterniond::Identity()), 4);         // +z
  EXPECT_EQ(face_up(exp_rotation({3.1, 0.0, 0.0})), 5);   // -z
  EXPECT_EQ(face_up(exp_rotation({1.5, 0.0, 0.0})), 2);   // +y
  EXPECT_EQ(face_up(exp_rotation({-1.5, 0.0, 0.0})), 3);  // -y
  EXPECT_EQ(face_up(exp_rotation({0.0, -1.5, 0.0})), 0);  // +x
  EXPECT_EQ(face_up(exp_rotation({0.0, 1.5, 0.0})), 1);   // -x
}

}  // namespace
}  // namespace prescene::geometry
