// SPDX-License-Identifier: Apache-2.0
// The kernels for 16 pairs of triangles, on every instruction set of the machine, against exact arithmetic and against
// their scalar twin.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "triangle_pairs_equivalence_test.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "prescene/collision/triangle_pairs-inl.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::collision::HWY_NAMESPACE {
namespace {

PairVerdict pairs(const float* a, const float* b, std::uint32_t active) {
  return test_16(SixteenOf{a}, SixteenOf{b}, active);
}
PairVerdict four_against_4(const float* a, const float* b, std::uint32_t active) {
  return test_4_against_4(a, b, active);
}

}  // namespace
}  // namespace prescene::collision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include <gtest/gtest.h>

#include <cstdio>
#include <string>

#include "nasty_triangles.h"
#include "triangle_lanes.h"

namespace prescene::collision {
namespace {

HWY_EXPORT(pairs);
HWY_EXPORT(four_against_4);

struct Counts {
  int pairs = 0;
  int hits = 0;
  int unsure = 0;
};

// No sure answer is wrong, and where the twin is sure as well they agree.
void check_pair(const PairVerdict& verdict, std::size_t lane, const Triangle& a, const Triangle& b, Counts& counts) {
  ++counts.pairs;
  const bool hit = bit(verdict.hit, lane);
  const bool unsure = bit(verdict.unsure, lane);
  ASSERT_FALSE(hit && unsure);
  counts.hits += hit ? 1 : 0;
  counts.unsure += unsure ? 1 : 0;
  if (unsure) return;
  ASSERT_EQ(hit, triangles_intersect(a, b));
  const PairVerdict twin = test_triangle_pair(coordinates(a), coordinates(b));
  if (twin.unsure == 0) {
    ASSERT_EQ(hit, twin.hit == 1);
  }
}

void check_batch(Nastiness nastiness, core::RandomStream& random, Counts& counts) {
  const LaneBatch batch = nasty_batch(nastiness, random);
  const std::uint32_t active = random.next_u32() & 0xFFFFU;
  const PairVerdict each = HWY_DYNAMIC_DISPATCH(pairs)(batch.a.data(), batch.b.data(), 0xFFFF);
  const PairVerdict some = HWY_DYNAMIC_DISPATCH(pairs)(batch.a.data(), batch.b.data(), active);
  const PairVerdict four = HWY_DYNAMIC_DISPATCH(four_against_4)(batch.four_a.data(), batch.four_b.data(), 0xFFFF);
  ASSERT_EQ(some.hit, each.hit & active);
  ASSERT_EQ(some.unsure, each.unsure & active);
  for (std::size_t i = 0; i < 16; ++i) {
    check_pair(each, i, batch.pairs[i].a, batch.pairs[i].b, counts);
    check_pair(four, i, batch.pairs[i / 4].a, batch.pairs[i % 4].b, counts);
    if (testing::Test::HasFatalFailure()) return;
  }
}

class TrianglePairs : public TargetTest {};

TEST_P(TrianglePairs, AreNeverSureAndWrong) {
  constexpr int kBatches = 2000;  // Of 16 pairs, times two tests, times the distributions.
  for (const Nastiness nastiness : kAllNastiness) {
    core::RandomStream random(23, core::Purpose::kTest, static_cast<std::uint64_t>(nastiness));
    Counts counts;
    for (int i = 0; i < kBatches && !HasFatalFailure(); ++i) check_batch(nastiness, random, counts);
    ASSERT_FALSE(HasFatalFailure()) << hwy::TargetName(GetParam()) << ", " << to_string(nastiness);
    std::printf("%s, %s: %d pairs, %d hits, %d unsure\n", hwy::TargetName(GetParam()),
                std::string(to_string(nastiness)).c_str(), counts.pairs, counts.hits, counts.unsure);
    if (nastiness == Nastiness::kPlain) {
      EXPECT_LT(counts.unsure, counts.pairs / 5000);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Targets, TrianglePairs, testing::ValuesIn(all_targets()), target_name);

}  // namespace
}  // namespace prescene::collision
#endif  // HWY_ONCE
