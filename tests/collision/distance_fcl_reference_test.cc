// SPDX-License-Identifier: Apache-2.0
// Distances of the default tree against FCL's, on configurations from the verge of contact to a third of the size.
#include <gmock/gmock.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "prescene/collision/distance_queries.h"
#include "tests/peers/mesh_collision.h"
#include "tests/support/collision_meshes.h"
#include "tests/support/contact_configurations.h"

namespace prescene::collision::distance_fcl_reference_test {
namespace {

using tests::PlacementMethod;

constexpr int kEach = 90;  // of five distances by two methods
constexpr int kScattered = 100;

void expect_same_distances(const std::shared_ptr<const Mesh>& a, const std::shared_ptr<const Mesh>& b) {
  core::ThreadPool pool(1);
  const TriangleTree tree_a = TriangleTree::build(a, {}, pool), tree_b = TriangleTree::build(b, {}, pool);
  QueryScratch scratch;
  const std::unique_ptr<tests::MeshPairPeer> fcl = tests::make_fcl_pair(a, b, tests::FclVolume::kObbRss);
  tests::ContactConfigurations make(
      a, b,
      {[&](const Transform& X_AB) { return collide(tree_a, tree_b, X_AB, scratch); },
       [&](const Transform& X_AB) { return distance(tree_a, tree_b, X_AB, {}, scratch)->distance; }},
      1);
  std::vector<Transform> configurations = make.scattered(kScattered);
  for (const PlacementMethod method : {PlacementMethod::kSphere, PlacementMethod::kGrid}) {
    for (const double share : {0.0, 0.001, 0.01, 0.05, 0.3}) {
      const std::vector<Transform> placed = make.at_distance(share, kEach, method);
      configurations.insert(configurations.end(), placed.begin(), placed.end());
    }
  }

  const double size = make.size();
  double worst = 0.0;
  int apart = 0;
  for (const Transform& X_AB : configurations) {
    const double answer = distance(tree_a, tree_b, X_AB, {}, scratch)->distance;
    EXPECT_EQ(answer == 0.0, collide(tree_a, tree_b, X_AB, scratch));
    worst = std::max(worst, std::abs(answer - std::max(0.0, *fcl->distance(X_AB))) / size);
    apart += answer > 0.0 ? 1 : 0;
  }
  std::printf("compared: %s and %s: %zu distances with FCL, %d of them positive; at most %.1e of the size off\n",
              a->name().c_str(), b->name().c_str(), configurations.size(), apart, worst);
  EXPECT_EQ(configurations.size(), static_cast<std::size_t>(kScattered + 10 * kEach));
  // FCL moves B's vertices in double precision.
  EXPECT_LT(worst, 1e-6);
}

struct Files {
  std::string_view a;
  std::string_view b;
};

class DistancesOfRecordedPairs : public testing::TestWithParam<Files> {};

TEST_P(DistancesOfRecordedPairs, AreThoseOfFcl) {
  const std::shared_ptr<const Mesh> a = tests::read_collision_mesh(GetParam().a);
  const std::shared_ptr<const Mesh> b = tests::read_collision_mesh(GetParam().b);
  if (a == nullptr || b == nullptr) GTEST_SKIP() << tests::missing_meshes_message();
  expect_same_distances(a, b);
}

INSTANTIATE_TEST_SUITE_P(Distance, DistancesOfRecordedPairs,
                         testing::Values(Files{"household/milk_carton.ply", "household/cereal_box.ply"},
                                         Files{"household/drinking_glass.ply", "household/plate_8in.ply"},
                                         Files{"robot/allegro_finger_tip.ply", "robot/robotiq_2f85_driver.ply"},
                                         Files{"household/ycb_scissors.ply", "household/ycb_extra_large_clamp.ply"},
                                         Files{"scans/stanford_bunny_closed.ply", "scans/spot_cow.ply"}),
                         [](const testing::TestParamInfo<Files>& files) {
                           return std::filesystem::path(files.param.a).stem().string() + "_" +
                                  std::filesystem::path(files.param.b).stem().string();
                         });

TEST(DistancesOfMadePairs, AreThoseOfFcl) {
  expect_same_distances(tests::collision_mesh(tests::make_bumpy_sphere(0.1, 3000), "bumpy_sphere"),
                        tests::collision_mesh(tests::make_knot(0.1, 3000), "knot"));
  expect_same_distances(tests::collision_mesh(tests::make_wavy_sheet(0.2, 1000), "wavy_sheet"),
                        tests::collision_mesh(tests::make_wavy_sheet(0.1, 1000), "small_wavy_sheet"));
}

}  // namespace
}  // namespace prescene::collision::distance_fcl_reference_test
