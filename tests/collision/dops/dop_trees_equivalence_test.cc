// SPDX-License-Identifier: Apache-2.0
// Every tree answers as trying all pairs of triangles does.
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <bit>
#include <cmath>
#include <cstdio>

#include "dop_cases.h"
#include "prescene/collision/dops/boxtree.h"
#include "prescene/collision/dops/bvhlite_tree.h"
#include "prescene/collision/dops/dop_tree.h"
#include "prescene/collision/dops/simdop_tree.h"
#include "tests/support/allocations.h"
#include "tests/support/collision_meshes.h"
#include "tests/support/target_test.h"

namespace prescene::collision {
namespace {

class DopTrees : public ::testing::Test {
 protected:
  ~DopTrees() override {
    use_target(0);
    std::printf("%d poses compared, %d of them colliding\n", compared_, colliding_);
  }

  // `query`(X_AB) is asked about all poses of a case.
  template <class Query>
  void expect_right(const DopCase& pair, const Query& query) {
    for (const PosedPair& pose : pair.poses) {
      ASSERT_EQ(query(pose.X_AB), pose.collides) << pair.name;
      ++compared_;
      colliding_ += pose.collides ? 1 : 0;
    }
  }

  void expect_simdop_right(const SimdopOptions& options) {
    SCOPED_TRACE("k " + std::to_string(options.k) + ", branching " + std::to_string(options.branching) + ", " +
                 std::string(to_string(options.builder)));
    for (const DopCase& pair : dop_cases()) {
      const SimdopTree a = SimdopTree::build(pair.a, options, pool_);
      const SimdopTree b = SimdopTree::build(pair.b, options, pool_);
      expect_right(pair, [&](const Transform& X_AB) { return collide(a, b, X_AB, scratch_); });
      if (HasFatalFailure()) return;
    }
  }

  void expect_bvhlite_right(const BvhLiteOptions& options, QueryCounts* counts = nullptr) {
    SCOPED_TRACE("k " + std::to_string(options.k) + ", " + std::to_string(options.bits) + " bits, branching " +
                 std::to_string(options.branching));
    for (const DopCase& pair : dop_cases()) {
      const BvhLiteTree a = BvhLiteTree::build(pair.a, options, pool_);
      const BvhLiteTree b = BvhLiteTree::build(pair.b, options, pool_);
      expect_right(pair, [&](const Transform& X_AB) { return collide(a, b, X_AB, lite_scratch_, counts); });
      if (HasFatalFailure()) return;
    }
  }

  void expect_boxtree_right(const BoxtreeOptions& options) {
    SCOPED_TRACE(to_string(options.builder));
    for (const DopCase& pair : dop_cases()) {
      const Boxtree a = Boxtree::build(pair.a, options, pool_);
      const Boxtree b = Boxtree::build(pair.b, options, pool_);
      expect_right(pair, [&](const Transform& X_AB) { return collide(a, b, X_AB); });
      if (HasFatalFailure()) return;
    }
  }

  core::ThreadPool pool_{2};
  QueryScratch scratch_;
  BvhLiteScratch lite_scratch_;
  int compared_ = 0;
  int colliding_ = 0;
};

TEST_F(DopTrees, BinaryTreeIsExact) {
  for (const int k : kDopSizes) {
    for (const DopCase& pair : dop_cases()) {
      const DopTreeOptions options{.k = k, .leaf_items = k == 14 ? 3 : 1};
      const DopTree a = DopTree::build(pair.a, options, pool_);
      const DopTree b = DopTree::build(pair.b, options, pool_);
      expect_right(pair, [&](const Transform& X_AB) { return collide(a, b, X_AB); });
      ASSERT_FALSE(HasFatalFailure()) << "k " << k;
    }
  }
}

TEST_F(DopTrees, SimdopIsExactForAllSizes) {
  for (const int k : kDopSizes) {
    for (const int branching : {2, 4, 8, 16}) {
      for (const PlanePrecision precision : {PlanePrecision::kSingle, PlanePrecision::kHalf}) {
        SimdopOptions options{.k = k, .branching = branching, .leaf_items = k == 18 ? 5 : 1, .precision = precision};
        expect_simdop_right(options);
        options.traversal = SimdopTraversal::kOneVersusOne;
        expect_simdop_right(options);
        if (branching == 4) {
          options.traversal = SimdopTraversal::kFourVersusFour;
          expect_simdop_right(options);
        }
        if (HasFatalFailure()) return;
      }
    }
  }
}

TEST_F(DopTrees, SimdopIsExactForAllBuilders) {
  for (const Builder builder : kAllBuilders) {
    expect_simdop_right({.k = 26, .branching = 16, .builder = builder});
    expect_simdop_right({.k = 46, .branching = 4, .builder = builder, .traversal = SimdopTraversal::kFourVersusFour});
    if (HasFatalFailure()) return;
  }
}

TEST_F(DopTrees, SimdopIsExactForEveryInstructionSet) {
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    SCOPED_TRACE(hwy::TargetName(target));
    use_target(target);
    for (const PlanePrecision precision : {PlanePrecision::kSingle, PlanePrecision::kHalf}) {
      for (const int branching : {2, 4, 8, 16}) {
        expect_simdop_right({.k = 46, .branching = branching, .leaf_items = 2, .precision = precision});
        expect_simdop_right(
            {.k = 14, .branching = branching, .precision = precision, .traversal = SimdopTraversal::kOneVersusOne});
      }
      expect_simdop_right(
          {.k = 32, .branching = 4, .precision = precision, .traversal = SimdopTraversal::kFourVersusFour});
      if (HasFatalFailure()) return;
    }
  }
}

TEST_F(DopTrees, BvhLiteIsExact) {
  for (const int bits : {4, 6, 8}) {
    for (const int k : kDopSizes) expect_bvhlite_right({.k = k, .bits = bits, .leaf_items = k == 46 ? 4 : 1});
    for (const int branching : {2, 7, 16}) expect_bvhlite_right({.k = 46, .bits = bits, .branching = branching});
    if (HasFatalFailure()) return;
  }
  for (const Builder builder : kAllBuilders) expect_bvhlite_right({.k = 26, .builder = builder});
}

TEST_F(DopTrees, BvhLiteDoesTheSameWithEveryInstructionSet) {
  for (const int bits : {4, 6, 8}) {
    QueryCounts usual;
    expect_bvhlite_right({.bits = bits}, &usual);
    for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
      SCOPED_TRACE(hwy::TargetName(target));
      use_target(target);
      QueryCounts counts;
      expect_bvhlite_right({.bits = bits}, &counts);
      if (HasFatalFailure()) return;
      EXPECT_EQ(counts.volume_tests, usual.volume_tests);
      EXPECT_EQ(counts.node_pairs, usual.node_pairs);
    }
    use_target(0);
  }
}

TEST_F(DopTrees, BoxtreesAreExact) {
  for (const Builder builder : kAllBuilders) {
    for (const int leaf_items : {1, 4}) expect_boxtree_right({.builder = builder, .leaf_items = leaf_items});
    if (HasFatalFailure()) return;
  }
  for (const DopCase& pair : dop_cases()) {
    const PlainBoxtree a = PlainBoxtree::build(pair.a, Builder::kMedian, pool_);
    const PlainBoxtree b = PlainBoxtree::build(pair.b, Builder::kMedian, pool_);
    expect_right(pair, [&](const Transform& X_AB) { return collide(a, b, X_AB); });
  }
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    SCOPED_TRACE(hwy::TargetName(target));
    use_target(target);
    expect_boxtree_right({});
  }
}

TEST_F(DopTrees, CountsDoNotChangeAnswers) {
  const DopCase& pair = dop_cases().front();
  const SimdopTree a = SimdopTree::build(pair.a, {}, pool_);
  const SimdopTree b = SimdopTree::build(pair.b, {}, pool_);
  const DopTree scalar_a = DopTree::build(pair.a, {}, pool_);
  const DopTree scalar_b = DopTree::build(pair.b, {}, pool_);
  const BvhLiteTree lite_a = BvhLiteTree::build(pair.a, {}, pool_);
  const BvhLiteTree lite_b = BvhLiteTree::build(pair.b, {}, pool_);
  const Boxtree boxes_a = Boxtree::build(pair.a, {}, pool_);
  const Boxtree boxes_b = Boxtree::build(pair.b, {}, pool_);
  std::array<QueryCounts, 4> counts;
  expect_right(pair, [&](const Transform& X_AB) { return collide(a, b, X_AB, scratch_, &counts[0]); });
  expect_right(pair, [&](const Transform& X_AB) { return collide(scalar_a, scalar_b, X_AB, &counts[1]); });
  expect_right(pair, [&](const Transform& X_AB) { return collide(lite_a, lite_b, X_AB, lite_scratch_, &counts[2]); });
  expect_right(pair, [&](const Transform& X_AB) { return collide(boxes_a, boxes_b, X_AB, &counts[3]); });
  for (const QueryCounts& c : counts) {
    EXPECT_GT(c.node_pairs, 0U);
    EXPECT_GT(c.volume_tests, c.node_pairs);
    EXPECT_GT(c.triangle_tests, 0U);
    EXPECT_LE(c.exact_tests, c.triangle_tests);
  }
}

TEST_F(DopTrees, QueriesDoNotAllocateOnceWarm) {
  if (!tests::can_count_allocations()) GTEST_SKIP() << "allocations cannot be counted in this build";
  const DopCase& pair = dop_cases().front();
  const SimdopTree a = SimdopTree::build(pair.a, {}, pool_);
  const SimdopTree b = SimdopTree::build(pair.b, {}, pool_);
  const BvhLiteTree lite_a = BvhLiteTree::build(pair.a, {}, pool_);
  const BvhLiteTree lite_b = BvhLiteTree::build(pair.b, {}, pool_);
  const DopTree scalar = DopTree::build(pair.a, {}, pool_);
  const Boxtree boxes = Boxtree::build(pair.a, {}, pool_);
  const auto ask_all = [&] {
    int hits = 0;
    for (const PosedPair& pose : pair.poses) {
      hits += collide(a, b, pose.X_AB, scratch_) ? 1 : 0;
      hits += collide(lite_a, lite_b, pose.X_AB, lite_scratch_) ? 1 : 0;
      hits += collide(scalar, scalar, pose.X_AB) ? 1 : 0;
      hits += collide(boxes, boxes, pose.X_AB) ? 1 : 0;
    }
    return hits;
  };
  const int first = ask_all();
  const std::uint64_t before = tests::allocation_count();
  const int second = ask_all();
  EXPECT_EQ(tests::allocation_count(), before);
  EXPECT_EQ(first, second);
}

TEST_F(DopTrees, HalfPrecisionTakesHalfTheMemory) {
  const auto mesh = tests::collision_mesh(tests::make_bumpy_sphere(0.1, 3000), "bumpy sphere");
  const SimdopTree half = SimdopTree::build(mesh, {.branching = 16, .precision = PlanePrecision::kHalf}, pool_);
  const SimdopTree single = SimdopTree::build(mesh, {.branching = 16, .precision = PlanePrecision::kSingle}, pool_);
  EXPECT_EQ(2 * half.plane_bytes(), single.plane_bytes());
  const auto bytes = [](const SimdopTree& tree) {
    return static_cast<double>(tree.plane_bytes() + tree.nodes().bytes());
  };
  EXPECT_LE(bytes(half), 0.51 * bytes(single));
  // And the rounded planes still bound what they bounded.
  const DopDirections& directions = DopDirections::of(half.options().k);
  const std::size_t size = 16 * static_cast<std::size_t>(half.options().k);
  for (std::size_t node = 0; node < half.nodes().size(); ++node) {
    for (std::size_t p = 0; p < size / 16; ++p) {
      const DopAxis d = directions.direction(p % 2 == 0 ? p / 2 : directions.axes().size() + p / 2);
      double shift = 0.0;
      for (std::size_t c = 0; c < 3; ++c)
        shift += d[c] * static_cast<double>(SimdopTree::kShift) * half.nodes()[node].shift[c];
      for (int lane = 0; lane < std::popcount(half.nodes()[node].children); ++lane) {
        const std::size_t i = node * size + 16 * p + static_cast<std::size_t>(lane);
        const auto exact = static_cast<double>(single.single_planes()[i]);
        const double rounded = static_cast<double>(from_half(half.half_planes()[i])) + shift;
        ASSERT_GE(rounded, exact);
        ASSERT_LT(rounded - exact, 1e-3 * (std::abs(exact - shift) + 1e-3));
      }
    }
  }
}

}  // namespace
}  // namespace prescene::collision
