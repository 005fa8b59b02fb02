// SPDX-License-Identifier: Apache-2.0
// Collision queries against brute force by the exact test, and the laws that any answer obeys.
#include "prescene/collision/batch_queries.h"
#include "prescene/collision/triangle_queries.h"

#include <gmock/gmock.h>
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <limits>
#include <vector>

#include "prescene/collision/exact_triangles.h"
#include "prescene/collision/triangle_pair_distance.h"
#include "prescene/core/random.h"
#include "tests/support/allocations.h"
#include "tests/support/generators.h"
#include "tests/support/target_test.h"

namespace prescene::collision::triangle_queries_laws_test {
namespace {

std::shared_ptr<const Mesh> to_mesh(const geometry::TriangleMesh& mesh) {
  auto made = Mesh::make(mesh, "mesh");
  RC_ASSERT(made.ok());
  return *made;
}

TriangleTree tree_of(const geometry::TriangleMesh& mesh) {
  core::ThreadPool pool(1);
  return TriangleTree::build(to_mesh(mesh), {}, pool);
}

std::vector<TrianglePair> brute_force_pairs(const Mesh& a, const Mesh& b, const Transform& X_AB) {
  std::vector<TrianglePair> pairs;
  for (std::uint32_t k = 0; k < b.triangle_count(); ++k) {
    Triangle placed = b.corners(k);
    for (Vector3f& p : placed) p = X_AB * p;
    for (std::uint32_t i = 0; i < a.triangle_count(); ++i) {
      if (triangles_intersect(a.corners(i), placed)) pairs.push_back({i, k});
    }
  }
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

/// A pose of B that brings a random vertex of each body together, so that they touch or overlap a little.
Transform touching_pose(const Mesh& a, const Mesh& b) {
  geometry::Pose X_AB;
  X_AB.rotation = *tests::rotations();
  const auto pick = [](const Mesh& mesh) {
    return mesh.vertices()[*rc::gen::inRange<std::size_t>(0, mesh.vertices().size())].cast<double>().eval();
  };
  const geometry::Vector3d meet = pick(a);
  X_AB.translation = meet - X_AB.rotation * pick(b) + *tests::vectors(0.01);
  const auto made = to_transform(X_AB);
  RC_ASSERT(made.ok());
  return *made;
}

TEST(TriangleQueries, FindWhatBruteForceFinds) {
  int configurations = 0;
  int intersecting = 0;
  EXPECT_TRUE(tests::check_law([&] {
    const TriangleTree a = tree_of(*tests::closed_meshes());
    const TriangleTree b = tree_of(*tests::closed_meshes());
    QueryScratch scratch;
    for (int i = 0; i < 4; ++i) {
      const Transform X_AB = touching_pose(a.mesh(), b.mesh());
      const std::vector<TrianglePair> expected = brute_force_pairs(a.mesh(), b.mesh(), X_AB);
      RC_ASSERT(collide(a, b, X_AB, scratch) == !expected.empty());
      const auto first = first_pair(a, b, X_AB, scratch);
      RC_ASSERT(first.has_value() == !expected.empty());
      if (first) RC_ASSERT(std::binary_search(expected.begin(), expected.end(), *first));
      std::vector<TrianglePair> pairs;
      RC_ASSERT(all_pairs(a, b, X_AB, expected.size(), &pairs, scratch));
      std::sort(pairs.begin(), pairs.end());
      RC_ASSERT(pairs == expected);
      if (!expected.empty()) {
        pairs.clear();
        RC_ASSERT(!all_pairs(a, b, X_AB, expected.size() - 1, &pairs, scratch));
        RC_ASSERT(pairs.size() == expected.size() - 1);
      }
      ++configurations;
      intersecting += expected.empty() ? 0 : 1;
    }
  }));
  std::printf("compared: drawn pairs: %d configurations with brute force; %d collide\n", configurations, intersecting);
  EXPECT_GT(intersecting, configurations / 10);
  EXPECT_LT(intersecting, configurations);
}

/// Smallest distance of the triangles, m, by trying all.
double brute_force_distance(const Mesh& a, const Mesh& b, const Transform& X_AB) {
  double least = std::numeric_limits<double>::infinity();
  for (std::uint32_t k = 0; k < b.triangle_count(); ++k) {
    Triangle placed = b.corners(k);
    for (Vector3f& p : placed) p = X_AB * p;
    for (std::uint32_t i = 0; i < a.triangle_count(); ++i)
      least = std::min(least, triangle_pair_distance(a.corners(i), placed).distance);
  }
  return least;
}

// What is rounded differently may answer differently only where the surfaces are within that rounding of each other.
void assert_same_but_for_rounding(bool one, bool other, const TriangleTree& a, const TriangleTree& b,
                                  const Transform& X_AB) {
  if (one == other) return;
  const double size = static_cast<double>(a.radius() + b.radius());
  RC_ASSERT(brute_force_distance(a.mesh(), b.mesh(), X_AB) < 1e-5 * size);
}

TEST(TriangleQueries, AreSymmetricInTheBodies) {
  EXPECT_TRUE(tests::check_law([] {
    const TriangleTree a = tree_of(*tests::closed_meshes());
    const TriangleTree b = tree_of(*tests::closed_meshes());
    QueryScratch scratch;
    const Transform X_AB = touching_pose(a.mesh(), b.mesh());
    assert_same_but_for_rounding(collide(a, b, X_AB, scratch), collide(b, a, inverse(X_AB), scratch), a, b, X_AB);
  }));
}

TEST(TriangleQueries, DoNotSeeACommonRigidMotion) {
  EXPECT_TRUE(tests::check_law([] {
    const geometry::TriangleMesh mesh_a = *tests::closed_meshes();
    const geometry::TriangleMesh mesh_b = *tests::closed_meshes();
    const geometry::Pose X_MA = *tests::poses(0.1);
    const geometry::Pose X_MB = *tests::poses(0.1);
    const TriangleTree a = tree_of(mesh_a);
    const TriangleTree b = tree_of(mesh_b);
    QueryScratch scratch;
    const Transform X_AB = touching_pose(a.mesh(), b.mesh());
    geometry::Pose pose;
    Eigen::Matrix3d R;
    for (int i = 0; i < 9; ++i) R(i / 3, i % 3) = static_cast<double>(X_AB.rotation[static_cast<std::size_t>(i)]);
    pose.rotation = geometry::Quaterniond(R).normalized();
    pose.translation = Eigen::Map<const Vector3f>(X_AB.translation.data()).cast<double>();
    // The same bodies, each described in another frame of its own.
    const TriangleTree moved_a = tree_of(geometry::transformed(mesh_a, X_MA));
    const TriangleTree moved_b = tree_of(geometry::transformed(mesh_b, X_MB));
    const auto moved_X = to_transform(X_MA * pose * X_MB.inverse());
    RC_ASSERT(moved_X.ok());
    assert_same_but_for_rounding(collide(a, b, X_AB, scratch), collide(moved_a, moved_b, *moved_X, scratch), a, b,
                                 X_AB);
  }));
}

TEST(TriangleQueries, AnswerAlikeForEveryTreeAndInstructionSet) {
  EXPECT_TRUE(tests::check_law([] {
    core::ThreadPool pool(1);
    const auto mesh_a = to_mesh(*tests::closed_meshes());
    const auto mesh_b = to_mesh(*tests::closed_meshes());
    const Transform X_AB = touching_pose(*mesh_a, *mesh_b);
    QueryScratch scratch;
    const TriangleTree a = TriangleTree::build(mesh_a, {}, pool);
    const bool expected = collide(a, TriangleTree::build(mesh_b, {}, pool), X_AB, scratch);
    for (const Builder builder : kAllBuilders) {
      for (const bool rotated : {false, true}) {
        const TriangleTree b = TriangleTree::build(mesh_b, {builder, rotated}, pool);
        RC_ASSERT(collide(a, b, X_AB, scratch) == expected);
        const std::array<Transform, 3> batch = {X_AB, X_AB, X_AB};
        std::array<bool, 3> answers{};
        for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
          const UseTarget only(target);
          RC_ASSERT(collide(a, b, X_AB, scratch) == expected);
          collide(a, b, batch, answers, scratch);
          RC_ASSERT(answers[0] == expected && answers[2] == expected);
        }
      }
    }
  }));
}

/// A configuration that moves no point within `reach` of the origin further than about `distance`.
Transform nudged(const Transform& X_AB, double distance, double reach) {
  geometry::Pose X;
  Eigen::Matrix3d R;
  for (int i = 0; i < 9; ++i) R(i / 3, i % 3) = static_cast<double>(X_AB.rotation[static_cast<std::size_t>(i)]);
  X.rotation = geometry::Quaterniond(R).normalized() * geometry::exp_rotation(*tests::vectors(distance / reach));
  X.translation = Eigen::Map<const Vector3f>(X_AB.translation.data()).cast<double>() + *tests::vectors(distance);
  const auto made = to_transform(X);
  RC_ASSERT(made.ok());
  return *made;
}

TEST(TriangleQueries, AnswerBatchesLikeSingleQueries) {
  int touching = 0;
  int configurations = 0;
  EXPECT_TRUE(tests::check_law([&] {
    const TriangleTree a = tree_of(*tests::closed_meshes());
    const TriangleTree b = tree_of(*tests::closed_meshes());
    QueryScratch scratch;
    const Transform X_AB = touching_pose(a.mesh(), b.mesh());
    const double size = static_cast<double>(std::max(a.mesh().size(), b.mesh().size()));
    const double distance = size * *rc::gen::element(0.0, 0.001, 0.01, 0.3);
    std::vector<Transform> batch(*rc::gen::inRange<std::size_t>(0, 40));
    for (Transform& X : batch) X = nudged(X_AB, distance, size);
    std::array<bool, 40> answers{};
    collide(a, b, batch, std::span(answers).first(batch.size()), scratch);
    for (std::size_t i = 0; i < batch.size(); ++i) {
      RC_ASSERT(answers[i] == collide(a, b, batch[i], scratch));
      touching += answers[i] ? 1 : 0;
    }
    configurations += static_cast<int>(batch.size());
  }));
  EXPECT_GT(touching, configurations / 10);
  EXPECT_LT(touching, configurations);
}

TEST(TriangleQueries, AnswerBatchesOfTinyBodiesLikeSingleQueries) {
  core::ThreadPool pool(1);
  core::RandomStream random(3, core::Purpose::kTest);
  QueryScratch scratch;
  int touching = 0;
  for (int exponent = -60; exponent >= -140; exponent -= 4) {
    const auto on_grid = [&] { return std::ldexp(static_cast<float>(random.uniform_below(4)), exponent); };
    const auto point = [&] {
      const float z = on_grid(), y = on_grid(), x = on_grid();
      return Vector3f(x, y, z);
    };
    for (int i = 0; i < 100; ++i) {
      const TriangleTree a = TriangleTree::build(*Mesh::make({point(), point(), point()}, {{0, 1, 2}}, "a"), {}, pool);
      const TriangleTree b = TriangleTree::build(*Mesh::make({point(), point(), point()}, {{0, 1, 2}}, "b"), {}, pool);
      std::array<Transform, 16> batch{};
      for (Transform& X : batch) X.translation = {on_grid(), on_grid(), on_grid()};
      std::array<bool, 16> answers{};
      collide(a, b, batch, answers, scratch);
      for (std::size_t k = 0; k < batch.size(); ++k) {
        EXPECT_EQ(answers[k], collide(a, b, batch[k], scratch)) << "2^" << exponent;
        touching += answers[k] ? 1 : 0;
      }
    }
  }
  EXPECT_GT(touching, 1000);
}

TEST(TriangleQueries, DoNotAllocateOnceWarm) {
  if (!tests::can_count_allocations()) GTEST_SKIP() << "allocations cannot be counted in this build";
  const TriangleTree a = tree_of(geometry::make_mesh(geometry::Sphere{0.1}, 64));
  const TriangleTree b = tree_of(geometry::make_mesh(geometry::Cylinder{0.05, 0.2}, 64));
  QueryScratch scratch;
  std::vector<TrianglePair> pairs;
  std::array<bool, 20> answers{};
  const auto X_AB = to_transform(geometry::Pose::from_translation({0.12, 0.01, 0.02}));
  ASSERT_TRUE(X_AB.ok());
  const std::vector<Transform> batch(answers.size(), *X_AB);
  for (const bool warm : {false, true}) {
    const std::uint64_t before = tests::allocation_count();
    pairs.clear();
    EXPECT_TRUE(collide(a, b, *X_AB, scratch));
    EXPECT_TRUE(first_pair(a, b, *X_AB, scratch).has_value());
    collide(a, b, batch, answers, scratch);
    EXPECT_TRUE(all_pairs(a, b, *X_AB, 100000, &pairs, scratch));
    EXPECT_TRUE(!warm || tests::allocation_count() == before);
  }
}

}  // namespace
}  // namespace prescene::collision::triangle_queries_laws_test
