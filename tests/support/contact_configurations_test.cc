// SPDX-License-Identifier: Apache-2.0
#include "tests/support/contact_configurations.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "prescene/geometry/primitives.h"
#include "tests/support/collision_meshes.h"
#include "tests/support/overlap_volume.h"

namespace prescene::tests {
namespace {

using collision::Transform;

constexpr double kRadiusA = 0.1, kRadiusB = 0.05;

double centre_distance(const Transform& X_AB) {
  return Eigen::Vector3f(X_AB * Eigen::Vector3f::Zero()).cast<double>().norm();
}
double gap(const Transform& X_AB) { return std::max(0.0, centre_distance(X_AB) - kRadiusA - kRadiusB); }

double angle_between(const Transform& a, const Transform& b) {
  double trace = 0.0;
  for (std::size_t i = 0; i < 9; ++i) trace += static_cast<double>(a.rotation[i]) * static_cast<double>(b.rotation[i]);
  return std::acos(std::clamp((trace - 1.0) / 2.0, -1.0, 1.0));
}

/// Two balls whose distance is known without any tree.
class ContactConfigurationsTest : public testing::Test {
 protected:
  ContactConfigurations make(std::uint64_t seed) const {
    return {ball_a_, ball_b_, {[](const Transform& X) { return gap(X) == 0.0; }, gap}, seed};
  }

  std::shared_ptr<const collision::Mesh> ball_a_ =
      collision_mesh(geometry::make_mesh(geometry::Sphere{kRadiusA}, 64), "ball_a");
  std::shared_ptr<const collision::Mesh> ball_b_ =
      collision_mesh(geometry::make_mesh(geometry::Sphere{kRadiusB}, 64), "ball_b");
};

TEST_F(ContactConfigurationsTest, KeepsTheDistance) {
  ContactConfigurations configurations = make(1);
  for (const PlacementMethod method : {PlacementMethod::kSphere, PlacementMethod::kGrid}) {
    for (const double share : {0.01, 0.05, 0.3}) {
      const std::vector<Transform> placed = configurations.at_distance(share, 50, method);
      EXPECT_EQ(placed.size(), 50U);
      for (const Transform& X_AB : placed)
        EXPECT_NEAR(gap(X_AB), share * configurations.size(), 1e-3 * configurations.size());
    }
  }
}

TEST_F(ContactConfigurationsTest, TouchesFromBothSides) {
  ContactConfigurations configurations = make(2);
  const double tolerance = ContactConfigurations::kTouchingGap * configurations.size();
  for (const PlacementMethod method : {PlacementMethod::kSphere, PlacementMethod::kGrid}) {
    const std::vector<Transform> placed = configurations.at_distance(0.0, 40, method);
    ASSERT_EQ(placed.size(), 40U);
    for (std::size_t i = 0; i < placed.size(); ++i) {
      EXPECT_EQ(gap(placed[i]) == 0.0, i % 2 == 1);
      EXPECT_NEAR(centre_distance(placed[i]), kRadiusA + kRadiusB, tolerance);
    }
  }
}

TEST_F(ContactConfigurationsTest, OverlapsByTheVolumeOfALens) {
  ContactConfigurations configurations = make(3);
  const std::vector<Transform> placed = configurations.penetrating(0.2, 20, PlacementMethod::kSphere);
  EXPECT_EQ(placed.size(), 20U);
  for (const Transform& X_AB : placed) {
    const double d = centre_distance(X_AB), sum = kRadiusA + kRadiusB, difference = kRadiusA - kRadiusB;
    const double lens =
        M_PI * std::pow(sum - d, 2) * (d * d + 2.0 * d * sum - 3.0 * difference * difference) / (12.0 * d);
    EXPECT_NEAR(lens / (4.0 / 3.0 * M_PI * std::pow(kRadiusB, 3)), 0.2, 0.04);
  }
}

TEST_F(ContactConfigurationsTest, BatchesAreNear) {
  ContactConfigurations configurations = make(4);
  const Transform X_AB = configurations.at_distance(0.05, 1, PlacementMethod::kSphere).at(0);
  const std::array<Transform, 16> batch = configurations.near(X_AB);
  for (const Transform& a : batch) {
    for (const Transform& b : batch) {
      const Eigen::Vector3f moved = (a * Eigen::Vector3f::Zero()) - (b * Eigen::Vector3f::Zero());
      EXPECT_LT(moved.norm(), 0.0101 * configurations.size());
      EXPECT_LT(angle_between(a, b), 1.01 * M_PI / 180.0);
    }
  }
}

TEST_F(ContactConfigurationsTest, StayAroundAPose) {
  ContactConfigurations configurations = make(7);
  const Transform X_AB = configurations.at_distance(0.0, 1, PlacementMethod::kSphere).at(0);
  int colliding = 0;
  for (const Transform& X : configurations.around(X_AB, 200)) {
    EXPECT_EQ(X.rotation, X_AB.rotation);
    EXPECT_LT(gap(X), 0.0101 * configurations.size());
    colliding += gap(X) == 0.0 ? 1 : 0;
  }
  EXPECT_GT(colliding, 60);
  EXPECT_LT(colliding, 140);
}

TEST_F(ContactConfigurationsTest, FollowTheSeed) {
  ContactConfigurations first = make(5), again = make(5), other = make(6);
  const std::vector<Transform> scattered = first.scattered(20);
  EXPECT_EQ(scattered, again.scattered(20));
  EXPECT_NE(scattered, other.scattered(20));
  EXPECT_EQ(first.at_distance(0.1, 10, PlacementMethod::kGrid), again.at_distance(0.1, 10, PlacementMethod::kGrid));
}

TEST(OverlapVolume, CountsWhatIsInside) {
  const auto box = collision_mesh(geometry::make_mesh(geometry::BoxShape{{0.2, 0.1, 0.3}}), "box");
  const SolidCells cells(*box);
  EXPECT_NEAR(cells.volume(), 0.006, 0.0004);
  Transform X_AB;
  EXPECT_NEAR(overlap_share(cells, cells, X_AB), 1.0, 1e-6);
  X_AB.translation = {0.1F, 0.0F, 0.0F};
  EXPECT_NEAR(overlap_share(cells, cells, X_AB), 0.5, 0.05);
  X_AB.translation = {0.21F, 0.0F, 0.0F};
  EXPECT_EQ(overlap_share(cells, cells, X_AB), 0.0);
}

TEST(CollisionMeshes, AreClosedAndFaceOutwards) {
  for (const geometry::TriangleMesh& mesh : {make_bumpy_sphere(0.1, 2000), make_knot(0.1, 2000)}) {
    const geometry::MeshTopology topology = geometry::mesh_topology(mesh);
    EXPECT_TRUE(topology.watertight() && topology.oriented());
    double volume = 0.0;
    for (const auto& t : mesh.triangles)
      volume += mesh.vertices[t[0]].dot(mesh.vertices[t[1]].cross(mesh.vertices[t[2]])) / 6.0;
    EXPECT_GT(volume, 0.0);
    EXPECT_NEAR(static_cast<double>(mesh.triangles.size()), 2000.0, 200.0);
  }
  EXPECT_EQ(geometry::mesh_topology(make_wavy_sheet(0.1, 200)).components, 1);
}

}  // namespace
}  // namespace prescene::tests
