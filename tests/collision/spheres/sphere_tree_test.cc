// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/spheres/sphere_tree.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <numeric>
#include <vector>

#include "prescene/core/random.h"

namespace prescene::collision::sphere_tree_test {
namespace {

using ::testing::HasSubstr;

std::shared_ptr<const SpherePacking> random_packing(std::size_t count, std::uint64_t seed) {
  core::RandomStream stream(seed, core::Purpose::kTest);
  std::vector<PackedSphere> spheres(count);
  for (PackedSphere& sphere : spheres) {
    for (int axis = 0; axis < 3; ++axis) sphere.centre[axis] = static_cast<float>(stream.uniform(-1.0, 1.0));
    sphere.radius = static_cast<float>(stream.uniform(1e-4, 0.05));
  }
  return *SpherePacking::make(std::move(spheres),
                              std::vector<SurfaceAnchor>(count, {Vector3f::UnitX(), Vector3f::UnitX()}), "random");
}

PackedSphere lane(const SphereTree& tree, std::uint32_t node, std::size_t k) {
  const float* lanes = tree.lanes(node);
  const std::size_t b = tree.branching();
  return {Vector3f(lanes[k], lanes[b + k], lanes[2 * b + k]), lanes[3 * b + k]};
}

bool holds(const PackedSphere& outer, const PackedSphere& inner) {
  return (outer.centre.cast<double>() - inner.centre.cast<double>()).norm() + static_cast<double>(inner.radius) <=
         static_cast<double>(outer.radius) * (1.0 + 1e-15);
}

// Places of all spheres below a node, and that its bounding sphere holds each of them.
std::vector<std::uint32_t> check_below(const SphereTree& tree, std::uint32_t node, const PackedSphere& bound) {
  const SphereTree::Node& n = tree.nodes()[node];
  EXPECT_GE(n.count, 1);
  EXPECT_LE(n.count, tree.branching());
  for (std::size_t k = n.count; k < tree.branching(); ++k) {
    EXPECT_EQ(lane(tree, node, k), (PackedSphere{Vector3f::Constant(SphereTree::kUnusedCentre), 0.0F}));
  }
  std::vector<std::uint32_t> places;
  for (std::uint32_t k = 0; k < n.count; ++k) {
    if (n.is_bottom()) {
      places.push_back(n.first + k);
      EXPECT_EQ(lane(tree, node, k), tree.packing().spheres()[tree.order()[n.first + k]]);
    } else {
      EXPECT_GT(n.first, node);
      const std::vector<std::uint32_t> below = check_below(tree, n.first + k, lane(tree, node, k));
      places.insert(places.end(), below.begin(), below.end());
    }
  }
  for (const std::uint32_t place : places) EXPECT_TRUE(holds(bound, tree.packing().spheres()[tree.order()[place]]));
  return places;
}

TEST(SphereTree, HoldsEachSphereOnceInsideOfAllItsBounds) {
  core::ThreadPool pool(2);
  for (const std::size_t count : {std::size_t{1}, std::size_t{2}, std::size_t{17}, std::size_t{1000}}) {
    for (const int branching : {4, 8, 16}) {
      const auto tree = SphereTree::make(random_packing(count, count), {.branching = branching}, pool);
      ASSERT_TRUE(tree.ok());
      std::vector<std::uint32_t> places = check_below(**tree, 0, (*tree)->root());
      std::vector<std::uint32_t> order((*tree)->order().begin(), (*tree)->order().end());
      std::vector<std::uint32_t> expected(count);
      std::iota(expected.begin(), expected.end(), 0U);
      std::sort(places.begin(), places.end());
      std::sort(order.begin(), order.end());
      EXPECT_EQ(places, expected);
      EXPECT_EQ(order, expected);
    }
  }
}

TEST(SphereTree, IsTheSameForAnyNumberOfThreads) {
  core::ThreadPool one(1);
  core::ThreadPool three(3);
  const auto packing = random_packing(500, 7);
  const auto a = SphereTree::make(packing, {}, one);
  const auto b = SphereTree::make(packing, {}, three);
  EXPECT_TRUE(std::ranges::equal((*a)->lanes(), (*b)->lanes()));
  EXPECT_TRUE(std::ranges::equal((*a)->nodes(), (*b)->nodes()));
}

TEST(SphereTree, RefusesOtherBranchings) {
  core::ThreadPool pool(1);
  const auto tree = SphereTree::make(random_packing(3, 1), {.branching = 5}, pool);
  EXPECT_THAT(tree.status().message(), HasSubstr("choose 4, 8 or 16"));
}

TEST(BoundingSphere, OfThreeIsTheSmallest) {
  // Touches all three from inside: the centre is where the distances less the radii agree.
  const std::vector<PackedSphere> spheres = {
      {Vector3f(-1, 0, 0), 0.5F}, {Vector3f(1, 0, 0), 0.5F}, {Vector3f(0, 1.2F, 0), 0.25F}};
  const PackedSphere bound = bounding_sphere(spheres);
  for (const PackedSphere& sphere : spheres) EXPECT_TRUE(holds(bound, sphere));
  EXPECT_LT(bound.radius, 1.5F * 1.01F);
}

}  // namespace
}  // namespace prescene::collision::sphere_tree_test
