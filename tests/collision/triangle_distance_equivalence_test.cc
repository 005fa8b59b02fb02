// SPDX-License-Identifier: Apache-2.0
// The distance kernels, on every instruction set of the machine, against double precision and their scalar twin.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "triangle_distance_equivalence_test.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "prescene/collision/triangle_distance-inl.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::collision::HWY_NAMESPACE {
namespace {

PairVerdict pairs(const float* a, const float* b, float limit, float* distances, std::uint32_t active) {
  return distance_of_pairs(a, b, limit, distances, active);
}
PairVerdict one_against_16(const float* one, const float* b, float limit, float* distances) {
  return distance_of_one_against_16(one, 1, b, limit, distances);
}
PairVerdict four_against_4(const float* a, const float* b, float limit, float* distances) {
  return distance_of_4_against_4(a, b, limit, distances);
}

}  // namespace
}  // namespace prescene::collision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>

#include "nasty_triangles.h"
#include "prescene/collision/triangle_pair_distance.h"
#include "triangle_lanes.h"

namespace prescene::collision {
namespace {

HWY_EXPORT(pairs);
HWY_EXPORT(one_against_16);
HWY_EXPORT(four_against_4);

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr double kRoundoff = 1.0 / 16777216.0;

struct Worst {
  double below = 0.0;  // Of the size.
  double above = 0.0;
};

double extent(const Triangle& a, const Triangle& b) {
  Eigen::AlignedBox3d box;
  for (const Triangle& t : {a, b}) {
    for (const Vector3f& p : t) box.extend(p.cast<double>());
  }
  return box.sizes().maxCoeff();
}

void check_distance(float found, const Triangle& a, const Triangle& b, Worst& worst) {
  const double size = extent(a, b);
  const double error = static_cast<double>(found) - triangle_pair_distance(a, b).distance;
  ASSERT_LE(std::abs(error), static_cast<double>(kDistanceError) * size + 1e-44);
  if (size < 1e-36) return;
  worst.below = std::max(worst.below, -error / size);
  worst.above = std::max(worst.above, error / size);
}

void check_lane(const PairVerdict& verdict, const std::array<float, 16>& distances, std::size_t lane, const Triangle& a,
                const Triangle& b, Worst& worst) {
  if (bit(verdict.hit, lane) || bit(verdict.unsure, lane)) {
    ASSERT_EQ(distances[lane], 0.0F);
  } else {
    check_distance(distances[lane], a, b, worst);
  }
}

void check_batch(Nastiness nastiness, core::RandomStream& random, Worst& worst) {
  const LaneBatch batch = nasty_batch(nastiness, random);
  alignas(64) std::array<float, 16> each{};
  alignas(64) std::array<float, 16> limited{};
  alignas(64) std::array<float, 16> against{};
  alignas(64) std::array<float, 16> four{};
  const float limit = static_cast<float>(random.uniform());
  const std::uint32_t active = random.next_u32() & 0xFFFFU;
  const PairVerdict of_each =
      HWY_DYNAMIC_DISPATCH(pairs)(batch.a.data(), batch.b.data(), kInfinity, each.data(), 0xFFFF);
  HWY_DYNAMIC_DISPATCH(pairs)(batch.a.data(), batch.b.data(), limit, limited.data(), active);
  const TriangleCoordinates one = coordinates(batch.pairs[0].a);
  const PairVerdict of_one =
      HWY_DYNAMIC_DISPATCH(one_against_16)(one.data(), batch.b.data(), kInfinity, against.data());
  const PairVerdict of_four =
      HWY_DYNAMIC_DISPATCH(four_against_4)(batch.four_a.data(), batch.four_b.data(), kInfinity, four.data());
  for (std::size_t i = 0; i < 16; ++i) {
    const auto& [a, b] = batch.pairs[i];
    check_lane(of_each, each, i, a, b, worst);
    check_lane(of_one, against, i, batch.pairs[0].a, b, worst);
    check_lane(of_four, four, i, batch.pairs[i / 4].a, batch.pairs[i % 4].b, worst);
    const float twin = single_triangle_pair_distance(coordinates(a), coordinates(b));
    if (twin != 0.0F) check_distance(twin, a, b, worst);
    if (testing::Test::HasFatalFailure()) return;
    // Left out only where it is not asked for or the limit or more.
    if (!bit(active, i)) {
      ASSERT_EQ(limited[i], kInfinity);
    } else if (limited[i] != each[i]) {
      ASSERT_EQ(limited[i], kInfinity);
      ASSERT_GE(each[i], limit - kDistanceError * static_cast<float>(extent(a, b)));
    }
  }
}

class TriangleDistances : public TargetTest {};

TEST_P(TriangleDistances, StayWithinTheirBounds) {
  constexpr int kBatches = 300;  // Of 16 pairs, tested four times.
  for (const Nastiness nastiness : kAllNastiness) {
    core::RandomStream random(29, core::Purpose::kTest, static_cast<std::uint64_t>(nastiness));
    Worst worst;
    for (int i = 0; i < kBatches; ++i) {
      check_batch(nastiness, random, worst);
      ASSERT_FALSE(HasFatalFailure()) << hwy::TargetName(GetParam()) << ", " << to_string(nastiness) << " " << i;
    }
    std::printf("%s, %s: below by %.1f u, above by %.1f u of the size\n", hwy::TargetName(GetParam()),
                std::string(to_string(nastiness)).c_str(), worst.below / kRoundoff, worst.above / kRoundoff);
  }
}

INSTANTIATE_TEST_SUITE_P(Targets, TriangleDistances, testing::ValuesIn(all_targets()), target_name);

}  // namespace
}  // namespace prescene::collision
#endif  // HWY_ONCE
