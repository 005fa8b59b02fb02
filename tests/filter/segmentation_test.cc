// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/proposals/segmentation.h"

#include <gtest/gtest.h>

#include <cmath>

#include "filter_fixture.h"
#include "prescene/filter/operators/initialise.h"
#include "prescene/filter/proposals/frame_surfaces.h"
#include "prescene/geometry/sampling.h"

namespace prescene::filter_tests {
namespace {

class OnTheTable : public ::testing::Test {
 protected:
  OnTheTable()
      : sequence_(
            still_sequence({box_model("box", {0.06, 0.10, 0.18}), can_model("can", 0.035, 0.11)},
                           {Pose::from_translation({0.0, -0.12, 0.09}), Pose::from_translation({0.05, 0.12, 0.055})})),
        observation_(sequence_.observe(0, *backends_.renderer)),
        sampled_(sample_depth(*observation_.frame.depth, observation_.frame.camera, options_)) {}

  Backends backends_;
  SegmentationOptions options_;
  SimulatedSequence sequence_;
  belief::Observation observation_;
  SampledDepth sampled_;
};

TEST_F(OnTheTable, SamplesPixelsAndTheirPoints) {
  EXPECT_EQ(sampled_.camera.width, 160);
  int measured = 0, exact = 0;
  for (int y = 0; y < sampled_.camera.height; ++y)
    for (int x = 0; x < sampled_.camera.width; ++x) {
      const Vector3d& p = sampled_.points_C[static_cast<std::size_t>(y * sampled_.camera.width + x)];
      if (sampled_.depth(x, y) == 0.0f) continue;
      ++measured;
      // The ray through the full image's pixel 2 x + 1, or through a neighbour where that one is missing.
      const double u = sequence_.camera.project(p).x();
      EXPECT_NEAR(u, 2 * x + 1, 1.0 + 1e-6);
      EXPECT_NEAR(u, std::round(u), 1e-6);
      exact += std::abs(u - (2 * x + 1)) < 1e-6;
    }
  EXPECT_GT(measured, 10000);
  EXPECT_GT(exact, measured * 9 / 10);
}

TEST_F(OnTheTable, FindsTheTableAndWhatStandsOnIt) {
  const auto support = find_support_plane(sampled_, options_, {1, core::Purpose::kDetection});
  ASSERT_TRUE(support.has_value());
  const geometry::Plane plane_W = geometry::transformed(support->region.plane_C, sequence_.X_WC);
  EXPECT_GT(plane_W.normal.z(), std::cos(0.01));
  EXPECT_NEAR(plane_W.offset, 0.0, 0.003);
  EXPECT_LT(support->rms, 0.005);

  const Vector3d up_C = sequence_.X_WC.rotation.conjugate() * Vector3d::UnitZ();
  const std::vector<FlatPatch> patches =
      find_flat_patches(sampled_, up_C, {}, 0.05, options_, {1, core::Purpose::kDetection});
  geometry::Image<std::uint8_t> explained =
      surroundings_of(sampled_, sequence_.X_WC, Vector3d::UnitZ(), {}, {}, {}, patches, options_).background;
  const std::vector<Cluster> clusters = find_clusters(sampled_, explained, options_);
  ASSERT_EQ(clusters.size(), 2u);
  EXPECT_GE(clusters[0].pixels.size(), clusters[1].pixels.size());
  for (const Cluster& cluster : clusters) {
    Vector3d mean = Vector3d::Zero();
    for (const Vector3d& p : cluster.points_C)
      mean += sequence_.X_WC * p / static_cast<double>(cluster.points_C.size());
    EXPECT_LT(std::min((mean - Vector3d(0.0, -0.12, 0.09)).norm(), (mean - Vector3d(0.05, 0.12, 0.055)).norm()), 0.06);
  }
  for (const int i : clusters[0].pixels) explained.data()[i] = 1;
  EXPECT_EQ(find_clusters(sampled_, explained, options_).size(), 1u);
}

TEST_F(OnTheTable, UpIsObeyed) {
  const Vector3d sideways_C = sequence_.X_WC.rotation.conjugate() * Vector3d::UnitY();
  const auto wall = find_support_plane(sampled_, options_, {1, core::Purpose::kDetection}, sideways_C);
  if (wall) {
    EXPECT_GT((sequence_.X_WC.rotation * wall->region.plane_C.normal).y(), 0.8);
  }
  const Vector3d up_C = sequence_.X_WC.rotation.conjugate() * Vector3d::UnitZ();
  EXPECT_TRUE(find_support_plane(sampled_, options_, {1, core::Purpose::kDetection}, up_C).has_value());
}

TEST_F(OnTheTable, BecomesASupportOfTheScene) {
  MeshCache meshes;
  const std::vector<belief::Support> supports =
      supports_from_frame(sampled_, sequence_.X_WC, belief::Scene(), {}, meshes, {1, core::Purpose::kDetection});
  ASSERT_EQ(supports.size(), 1u);
  const belief::Support* support = &supports.front();
  const auto& shape = std::get<belief::PrimitiveShape>(support->collision.front());
  const auto& box = std::get<geometry::BoxShape>(shape.primitive);
  const Vector3d top = support->X_WS * Vector3d(0.0, 0.0, 0.5 * box.size.z());
  EXPECT_NEAR(top.z(), 0.0, 0.004);
  EXPECT_GT((support->X_WS.rotation * Vector3d::UnitZ()).z(), std::cos(0.01));
  EXPECT_GT(std::min(box.size.x(), box.size.y()), 0.5);
}

TEST(FindSupportPlane, NothingInAnEmptyImage) {
  const geometry::PinholeCamera camera = test_camera();
  const geometry::DepthImage depth(camera.width, camera.height);
  const SampledDepth sampled = sample_depth(depth, camera, {});
  EXPECT_FALSE(find_support_plane(sampled, {}, {1, core::Purpose::kDetection}).has_value());
}

TEST(ConvexOutline, HoldsItsPointsWhateverTheirOrder) {
  core::RandomStream stream(7, core::Purpose::kTest);
  geometry::Plane plane;
  plane.normal = geometry::uniform_direction(stream);
  plane.offset = 0.8;
  std::vector<Vector3d> points;
  for (int i = 0; i < 100; ++i) {
    const Vector3d p = geometry::normal_vector(stream);
    points.push_back(p - plane.signed_distance(p) * plane.normal);
  }
  rendering::SupportRegion region{plane, convex_outline(plane, points, 1e-6)};
  for (const Vector3d& p : points) EXPECT_TRUE(stands_on(region, p + 0.1 * plane.normal));
  for (const Vector3d& p : region.outline_C) EXPECT_NEAR(plane.signed_distance(p), 0.0, 1e-9);
  EXPECT_FALSE(stands_on(region, points[0] + 20.0 * plane.normal.unitOrthogonal()));
  std::reverse(points.begin(), points.end());
  EXPECT_EQ(convex_outline(plane, points, 1e-6).size(), region.outline_C.size());
}

}  // namespace
}  // namespace prescene::filter_tests
