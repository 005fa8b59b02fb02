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
  return distance_of_16(SixteenOf{a}, SixteenOf{b}, limit, distances, active);
}
PairVerdict pairs_and_between(const float* a, const float* b, float* distances, float (*between)[16]) {
  return distance_of_16<true>(SixteenOf{a}, SixteenOf{b}, std::numeric_limits<float>::infinity(), distances, 0xFFFF,
                              between);
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
HWY_EXPORT(pairs_and_between);
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

// As long as the triangles are apart, and from a point of the one to a point of the other: the distances along it of
// their corners say that.
void check_between(const Vector3f& between, const Triangle& a, const Triangle& b, const PairVerdict& verdict,
                   std::size_t lane) {
  const double size = extent(a, b);
  if (bit(verdict.hit | verdict.unsure, lane) || size < 1e-36) return;
  const Eigen::Vector3d v = between.cast<double>();
  const double error = 2.0 * static_cast<double>(kDistanceError) * size;
  ASSERT_LE(std::abs(v.norm() - triangle_pair_distance(a, b).distance), error);
  if (v.norm() <= 100.0 * error) return;
  // The plane across it separates them, up to what turns it.
  double gap = std::numeric_limits<double>::infinity();
  for (const Vector3f& p : a) {
    for (const Vector3f& q : b) gap = std::min(gap, v.normalized().dot(q.cast<double>() - p.cast<double>()));
  }
  ASSERT_GE(gap, v.norm() - size * std::sqrt(error / v.norm()) - error);
}

void check_batch(Nastiness nastiness, core::RandomStream& random, Worst& worst) {
  const LaneBatch batch = nasty_batch(nastiness, random);
  alignas(64) std::array<float, 16> each{};
  alignas(64) std::array<float, 16> limited{};
  alignas(64) std::array<float, 16> again{};
  alignas(64) float between[3][16];  // NOLINT(modernize-avoid-c-arrays): as the kernels take it.
  alignas(64) std::array<float, 16> four{};
  const float limit = static_cast<float>(random.uniform());
  const std::uint32_t active = random.next_u32() & 0xFFFFU;
  const PairVerdict of_each =
      HWY_DYNAMIC_DISPATCH(pairs)(batch.a.data(), batch.b.data(), kInfinity, each.data(), 0xFFFF);
  HWY_DYNAMIC_DISPATCH(pairs)(batch.a.data(), batch.b.data(), limit, limited.data(), active);
  ASSERT_EQ(of_each, HWY_DYNAMIC_DISPATCH(pairs_and_between)(batch.a.data(), batch.b.data(), again.data(), between));
  const PairVerdict of_four =
      HWY_DYNAMIC_DISPATCH(four_against_4)(batch.four_a.data(), batch.four_b.data(), kInfinity, four.data());
  for (std::size_t i = 0; i < 16; ++i) {
    const auto& [a, b] = batch.pairs[i];
    check_lane(of_each, each, i, a, b, worst);
    ASSERT_EQ(again[i], each[i]);
    check_between({between[0][i], between[1][i], between[2][i]}, a, b, of_each, i);
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
  constexpr int kBatches = 300;  // Of 16 pairs, tested three times.
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
