// SPDX-License-Identifier: Apache-2.0
// One body against many is that body against each.
#include "prescene/collision/body_set.h"

#include <gmock/gmock.h>

#include <limits>
#include <memory>
#include <vector>

#include "prescene/collision/triangle_queries.h"
#include "prescene/core/random.h"
#include "tests/support/allocations.h"
#include "tests/support/collision_meshes.h"
#include "tests/support/generators.h"
#include "tests/support/target_test.h"

namespace prescene::collision::body_set_laws_test {
namespace {

using geometry::Pose;

std::shared_ptr<const TriangleTree> tree_of(const geometry::TriangleMesh& mesh) {
  core::ThreadPool pool(1);
  return std::make_shared<const TriangleTree>(TriangleTree::build(tests::collision_mesh(mesh, "mesh"), {}, pool));
}

Pose random_pose(core::RandomStream& random, double reach) {
  Pose X;
  const auto draw = [&] { return random.uniform(-1.0, 1.0); };
  X.rotation = geometry::exp_rotation({3.0 * draw(), 3.0 * draw(), 3.0 * draw()});
  const double z = draw(), y = draw(), x = draw();
  X.translation = reach * geometry::Vector3d(x, y, z);
  return X;
}

std::vector<std::uint32_t> one_by_one(const TriangleTree& a, const Pose& X_WA, const BodySet& bodies,
                                      QueryScratch& scratch) {
  std::vector<std::uint32_t> touching;
  for (std::uint32_t body = 0; body < bodies.size(); ++body) {
    const auto X_AB = relative_transform(X_WA, bodies.pose(body));
    EXPECT_TRUE(X_AB.ok());
    if (collide(a, bodies.tree(body), *X_AB, scratch)) touching.push_back(body);
  }
  return touching;
}

class ManyBodies : public TargetTest {};

TEST_P(ManyBodies, AreEachOfThem) {
  const std::vector<std::shared_ptr<const TriangleTree>> trees = {
      tree_of(geometry::make_mesh(geometry::BoxShape{{0.3, 0.05, 0.1}})), tree_of(tests::make_bumpy_sphere(0.1, 500)),
      tree_of(tests::make_knot(0.15, 1000)), tree_of(tests::make_wavy_sheet(0.4, 200))};
  core::RandomStream random(2, {});
  QueryScratch scratch;
  std::vector<std::uint32_t> touching;
  std::size_t contacts = 0;
  for (const std::uint32_t count : {0U, 1U, 15U, 16U, 17U, 150U}) {
    BodySet bodies;
    for (std::uint32_t i = 0; i < count; ++i) {
      const auto body = bodies.add(trees[i % trees.size()], random_pose(random, 0.6));
      ASSERT_TRUE(body.ok());
      EXPECT_EQ(*body, i);
    }
    for (int i = 0; i < 40; ++i) {
      const TriangleTree& a = *trees[static_cast<std::size_t>(i) % trees.size()];
      const Pose X_WA = random_pose(random, 0.6);
      QueryCounts counts;
      ASSERT_TRUE(collide_many(a, X_WA, bodies, &touching, scratch, &counts).ok());
      EXPECT_EQ(touching, one_by_one(a, X_WA, bodies, scratch));
      EXPECT_GE(counts.volume_tests, count);
      contacts += touching.size();
      if (count == 0) continue;
      EXPECT_TRUE(bodies.move(static_cast<std::uint32_t>(i) % count, random_pose(random, 0.6)).ok());
    }
  }
  EXPECT_GT(contacts, 50U);
}

TEST_P(ManyBodies, CountWhenTheyJustTouch) {
  // Boxes that share a face, also far from the world's origin: rounding decides, the same for one and for many.
  const auto box = tree_of(geometry::make_mesh(geometry::BoxShape{{0.1, 0.1, 0.1}}));
  QueryScratch scratch;
  std::vector<std::uint32_t> touching;
  core::RandomStream random(4, {});
  int contacts = 0;
  for (int i = 0; i < 200; ++i) {
    const Pose X_WA = random_pose(random, i % 2 == 0 ? 0.0 : 1000.0);
    BodySet bodies;
    for (int axis = 0; axis < 3; ++axis) {
      for (const double sign : {1.0, -1.0}) {
        const Pose X_AB = Pose::from_translation(sign * 0.1 * geometry::Vector3d::Unit(axis));
        ASSERT_TRUE(bodies.add(box, X_WA * X_AB).ok());
      }
    }
    ASSERT_TRUE(collide_many(*box, X_WA, bodies, &touching, scratch).ok());
    EXPECT_EQ(touching, one_by_one(*box, X_WA, bodies, scratch));
    contacts += static_cast<int>(touching.size());
  }
  EXPECT_GT(contacts, 200);
}

INSTANTIATE_TEST_SUITE_P(AllTargets, ManyBodies, testing::ValuesIn(all_targets()), target_name);

TEST(BodySets, RefusePosesThatAreNotFinite) {
  const auto box = tree_of(geometry::make_mesh(geometry::BoxShape{{0.1, 0.1, 0.1}}));
  Pose bad;
  bad.translation.x() = std::numeric_limits<double>::quiet_NaN();
  BodySet bodies;
  ASSERT_TRUE(bodies.add(box, {}).ok());
  const auto refused = bodies.add(box, bad);
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.status().message(), testing::HasSubstr("body 1"));
  EXPECT_EQ(bodies.size(), 1U);
  EXPECT_FALSE(bodies.move(0, bad).ok());
  EXPECT_EQ(bodies.pose(0), Pose());
  QueryScratch scratch;
  std::vector<std::uint32_t> touching = {7};
  EXPECT_FALSE(collide_many(*box, bad, bodies, &touching, scratch).ok());
  EXPECT_TRUE(touching.empty());
}

TEST(BodySets, DoNotAllocateOnceWarm) {
  if (!tests::can_count_allocations()) GTEST_SKIP() << "allocations cannot be counted in this build";
  const auto knot = tree_of(tests::make_knot(0.15, 1000));
  BodySet bodies;
  core::RandomStream random(3, {});
  for (int i = 0; i < 40; ++i) ASSERT_TRUE(bodies.add(knot, random_pose(random, 0.3)).ok());
  QueryScratch scratch;
  std::vector<std::uint32_t> touching;
  for (const bool warm : {false, true}) {
    const std::uint64_t before = tests::allocation_count();
    EXPECT_TRUE(bodies.move(3, {}).ok());
    EXPECT_TRUE(collide_many(*knot, {}, bodies, &touching, scratch).ok());
    EXPECT_TRUE(!warm || tests::allocation_count() == before);
  }
}

}  // namespace
}  // namespace prescene::collision::body_set_laws_test
