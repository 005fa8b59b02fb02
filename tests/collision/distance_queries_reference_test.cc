// SPDX-License-Identifier: Apache-2.0
// Distances of real and made meshes, on configurations scattered, near and just touching: against brute force in double
// precision for the smaller meshes, against FCL for the larger ones. FCL answers in double precision for B's vertices
// before they are rounded.
#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "prescene/collision/distance_queries.h"
#include "tests/peers/mesh_collision.h"
#include "tests/support/brute_force.h"
#include "tests/support/collision_meshes.h"
#include "tests/support/contact_configurations.h"

namespace prescene::collision::distance_queries_reference_test {
namespace {

using tests::PlacementMethod;

constexpr std::uint32_t kFewTriangles = 3500;

std::vector<Transform> make_configurations(const TriangleTree& a, const TriangleTree& b, QueryScratch* scratch) {
  tests::ContactConfigurations make(
      a.shared_mesh(), b.shared_mesh(),
      {[&](const Transform& X_AB) { return collide(a, b, X_AB, *scratch); },
       [&](const Transform& X_AB) { return distance(a, b, X_AB, {}, *scratch)->distance; }},
      7);
  std::vector<Transform> configurations = make.scattered(60);
  for (const PlacementMethod method : {PlacementMethod::kSphere, PlacementMethod::kGrid}) {
    for (const double share : {0.0, 0.01, 0.05, 0.3}) {
      const std::vector<Transform> made = make.at_distance(share, 12, method);
      configurations.insert(configurations.end(), made.begin(), made.end());
      if (share == 0.0) {
        for (const Transform& X_AB : made) {
          const std::vector<Transform> around = make.around(X_AB, 3);
          configurations.insert(configurations.end(), around.begin(), around.end());
        }
      }
    }
  }
  return configurations;
}

void expect_least_distances(const std::shared_ptr<const Mesh>& a, const std::shared_ptr<const Mesh>& b) {
  core::ThreadPool pool(1);
  const TriangleTree tree_a = TriangleTree::build(a, {}, pool);
  const TriangleTree tree_b = TriangleTree::build(b, {}, pool);
  QueryScratch scratch;
  const std::vector<Transform> configurations = make_configurations(tree_a, tree_b, &scratch);
  const double size = static_cast<double>(a->size()) + static_cast<double>(b->size());
  const bool few = a->triangle_count() + b->triangle_count() < kFewTriangles;
  const std::unique_ptr<tests::MeshPairPeer> fcl = tests::make_fcl_pair(a, b, tests::FclVolume::kObbRss);
  double worst = 0.0;
  int zero = 0;
  for (const Transform& X_AB : configurations) {
    const std::optional<Distance> found = distance(tree_a, tree_b, X_AB, {}, scratch);
    ASSERT_TRUE(found.has_value());
    const double d = found->distance;
    const double slack = 1e-6 * size;
    EXPECT_EQ(d == 0.0, collide(tree_a, tree_b, X_AB, scratch));
    const double expected =
        few ? tests::distance_by_brute_force(*a, *b, X_AB, d + slack) : std::max(0.0, *fcl->distance(X_AB));
    if (few) {
      EXPECT_EQ(d == 0.0, expected == 0.0);
    }
    EXPECT_NEAR(d, expected, slack);
    worst = std::max(worst, std::abs(d - expected));
    zero += d == 0.0 ? 1 : 0;
    EXPECT_TRUE(within_distance(tree_a, tree_b, X_AB, d, scratch));
    EXPECT_TRUE(within_distance(tree_a, tree_b, X_AB, 1.1 * d + slack, scratch));
    if (d > slack) {
      EXPECT_FALSE(within_distance(tree_a, tree_b, X_AB, d - slack, scratch));
    }
  }
  std::printf("%s and %s: %zu distances compared with %s, %d zero; the worst is off by %.1e of the sizes\n",
              a->name().c_str(), b->name().c_str(), configurations.size(), few ? "brute force" : "FCL", zero,
              worst / size);
}

struct Files {
  std::string_view a;
  std::string_view b;
};

class RecordedDistances : public testing::TestWithParam<Files> {};

TEST_P(RecordedDistances, AreLeast) {
  const std::shared_ptr<const Mesh> a = tests::read_collision_mesh(GetParam().a);
  const std::shared_ptr<const Mesh> b = tests::read_collision_mesh(GetParam().b);
  if (a == nullptr || b == nullptr) GTEST_SKIP() << tests::missing_meshes_message();
  expect_least_distances(a, b);
}

INSTANTIATE_TEST_SUITE_P(DistanceQueries, RecordedDistances,
                         testing::Values(Files{"household/milk_carton.ply", "household/cereal_box.ply"},
                                         Files{"household/drinking_glass.ply", "household/plate_8in.ply"},
                                         Files{"household/lemon.ply", "robot/panda_finger_visual.ply"},
                                         Files{"robot/allegro_finger_tip.ply", "robot/robotiq_2f85_driver.ply"},
                                         Files{"robot/robotiq_2f85_base.ply", "robot/iiwa14_link7.ply"},
                                         Files{"household/ycb_mug.ply", "household/ycb_spoon.ply"},
                                         Files{"scans/happy_buddha.ply", "scans/spot_cow.ply"}),
                         [](const testing::TestParamInfo<Files>& files) {
                           return std::filesystem::path(files.param.a).stem().string() + "_" +
                                  std::filesystem::path(files.param.b).stem().string();
                         });

TEST(MadeDistances, AreLeast) {
  expect_least_distances(tests::collision_mesh(tests::make_bumpy_sphere(0.1, 6000), "bumpy_sphere"),
                         tests::collision_mesh(tests::make_knot(0.1, 5000), "knot"));
  expect_least_distances(tests::collision_mesh(tests::make_wavy_sheet(0.2, 1000), "wavy_sheet"),
                         tests::collision_mesh(tests::make_wavy_sheet(0.1, 1000), "small_wavy_sheet"));
}

}  // namespace
}  // namespace prescene::collision::distance_queries_reference_test
