// SPDX-License-Identifier: Apache-2.0
#include "sweep_lanes.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sweep_lanes.cc"
#include <hwy/foreach_target.h>
// After foreach_target.h, which includes this file once for each instruction set.
#include <hwy/highway.h>

#include "lane_sums-inl.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::collision::HWY_NAMESPACE {

// Squares and products of three coordinates are off by a few roundings of their largest terms; thirty are allowed for.
constexpr float kRounding = 32.0F * 6e-8F;

/// The children of a node of B: where they are at the start in A, how they move, and how large they become.
struct MovingChildren {
  HWY_ALIGN float x[16];
  HWY_ALIGN float y[16];
  HWY_ALIGN float z[16];
  HWY_ALIGN float dx[16];
  HWY_ALIGN float dy[16];
  HWY_ALIGN float dz[16];
  HWY_ALIGN float radius[16];
};

template <std::size_t N>
HWY_INLINE void place(const float* lanes, const Sweep& s, float rounding, MovingChildren* moving) {
  const hn::CappedTag<float, N> d;
  for (std::size_t i = 0; i < N; i += hn::Lanes(d)) {
    const auto x = hn::Load(d, lanes + i);
    const auto y = hn::Load(d, lanes + N + i);
    const auto z = hn::Load(d, lanes + 2 * N + i);
    auto radius = hn::Load(d, lanes + 3 * N + i);
    const auto row = [&](const std::array<float, 9>& r, const std::array<float, 3>& t, std::size_t k) HWY_ATTR {
      return hn::Add(dot3(hn::Set(d, r[3 * k]), hn::Set(d, r[3 * k + 1]), hn::Set(d, r[3 * k + 2]), x, y, z),
                     hn::Set(d, t[k]));
    };
    float* from[3] = {moving->x, moving->y, moving->z};
    float* move[3] = {moving->dx, moving->dy, moving->dz};
    for (std::size_t k = 0; k < 3; ++k) {
      const auto start = row(s.start.rotation, s.start.translation, k);
      hn::Store(start, d, from[k] + i);
      hn::Store(hn::Sub(row(s.end.rotation, s.end.translation, k), start), d, move[k] + i);
    }
    if (s.bent) {
      const auto ex = row(s.bend, s.bend_offset, 0);
      const auto ey = row(s.bend, s.bend_offset, 1);
      const auto ez = row(s.bend, s.bend_offset, 2);
      const auto off = hn::Sqrt(dot3(ex, ey, ez, ex, ey, ez));
      radius = hn::Add(madd(radius, hn::Set(d, s.turned), off), radius);
    }
    hn::Store(hn::Add(radius, hn::Set(d, rounding)), d, moving->radius + i);
  }
}

/// A lower bound of the time at which each lane's sphere meets the sphere at `a`; above `latest` where it does not.
template <std::size_t N>
HWY_INLINE std::uint32_t meeting(const MovingChildren& b, float ax, float ay, float az, float ar, float latest,
                                 float* times) {
  const hn::CappedTag<float, N> d;
  std::uint32_t hits = 0;
  for (std::size_t k = 0; k < N; k += hn::Lanes(d)) {
    const auto x = hn::Sub(hn::Load(d, b.x + k), hn::Set(d, ax));
    const auto y = hn::Sub(hn::Load(d, b.y + k), hn::Set(d, ay));
    const auto z = hn::Sub(hn::Load(d, b.z + k), hn::Set(d, az));
    const auto dx = hn::Load(d, b.dx + k);
    const auto dy = hn::Load(d, b.dy + k);
    const auto dz = hn::Load(d, b.dz + k);
    const auto radii = hn::Add(hn::Load(d, b.radius + k), hn::Set(d, ar));
    const auto distance = dot3(x, y, z, x, y, z);
    const auto reach = hn::Mul(radii, radii);
    const auto square = dot3(dx, dy, dz, dx, dy, dz);
    const auto approach = hn::Neg(dot3(x, y, z, dx, dy, dz));
    // The roots of square t^2 - 2 approach t + outside, with rounding taken for contact.
    const auto rounding = hn::Mul(hn::Set(d, kRounding), hn::Add(distance, reach));
    const auto outside = hn::Sub(hn::Sub(distance, reach), rounding);
    const auto touching = hn::Le(outside, hn::Zero(d));
    const auto error = hn::Mul(hn::Mul(hn::Set(d, kRounding), square), distance);
    const auto discriminant = hn::Add(hn::Sub(hn::Mul(approach, approach), hn::Mul(square, outside)), error);
    const auto root = hn::Sqrt(hn::Max(discriminant, hn::Zero(d)));
    // approach is off by kRounding sqrt(square distance) at most.
    const auto slack = hn::Mul(hn::Set(d, kRounding), hn::Sqrt(hn::Mul(square, distance)));
    const auto early = hn::Sub(hn::Sub(approach, slack), root);
    const auto time = hn::IfThenZeroElse(touching, hn::Max(hn::Zero(d), hn::Div(early, square)));
    const auto nears = hn::And(hn::Gt(hn::Add(approach, slack), hn::Zero(d)), hn::Ge(discriminant, hn::Zero(d)));
    const auto hit = hn::And(hn::Or(touching, nears), hn::Le(time, hn::Set(d, latest)));
    hn::Store(time, d, times + k);
    hits |= mask_bits(d, hit) << k;
  }
  return hits;
}

template <std::size_t N>
void sweep_trees(const SphereTree& tree_a, const SphereTree& tree_b, const Sweep& s, float rounding,
                 SweepScratch* scratch, SweptPairs* pairs) {
  SweepScratch::Entry* entries = scratch->entries().data();
  std::size_t size = 0;
  entries[size++] = {0, 0, 0.0F};
  float latest = 1.0F;
  const auto meet = [&](std::uint32_t a, std::uint32_t b) {
    const auto rest = static_cast<float>(pairs->meet(a, b));
    latest = std::min(latest, std::nextafter(rest, 2.0F));
  };
  MovingChildren moving;
  HWY_ALIGN float times[16];
  while (size > 0) {
    const SweepScratch::Entry at = entries[--size];
    if (at.time > latest) continue;
    const SphereTree::Node& a = tree_a.nodes()[at.a];
    const SphereTree::Node& b = tree_b.nodes()[at.b];
    const float* lanes_a = tree_a.lanes(at.a);
    const std::size_t stride = tree_a.branching();
    place<N>(tree_b.lanes(at.b), s, rounding, &moving);
    const std::uint32_t used = (1U << b.count) - 1U;
    const std::size_t first = size;
    HWY_ALIGN float earliest_of_b[16];
    std::fill(earliest_of_b, earliest_of_b + 16, 2.0F);
    for (std::uint32_t i = 0; i < a.count; ++i) {
      std::uint32_t hits = used & meeting<N>(moving, lanes_a[i], lanes_a[stride + i], lanes_a[2 * stride + i],
                                             lanes_a[3 * stride + i], latest, times);
      if (a.is_bottom() && b.is_bottom()) {
        for (; hits != 0; hits &= hits - 1) {
          const auto k = static_cast<std::uint32_t>(std::countr_zero(hits));
          if (times[k] <= latest) meet(a.first + i, b.first + k);
        }
        continue;
      }
      float earliest = 2.0F;
      for (; hits != 0; hits &= hits - 1) {
        const auto k = static_cast<std::uint32_t>(std::countr_zero(hits));
        earliest = std::min(earliest, times[k]);
        earliest_of_b[k] = std::min(earliest_of_b[k], times[k]);
        if (!a.is_bottom() && !b.is_bottom()) entries[size++] = {a.first + i, b.first + k, times[k]};
      }
      if (b.is_bottom() && earliest <= 1.0F) entries[size++] = {a.first + i, at.b, earliest};
    }
    if (a.is_bottom() && !b.is_bottom()) {
      for (std::uint32_t k = 0; k < b.count; ++k) {
        if (earliest_of_b[k] <= 1.0F) entries[size++] = {at.a, b.first + k, earliest_of_b[k]};
      }
    }
    // The earliest on top, so that it bounds the others soon.
    std::sort(entries + first, entries + size, [](const SweepScratch::Entry& x, const SweepScratch::Entry& y) {
      return x.time > y.time || (x.time == y.time && (x.a > y.a || (x.a == y.a && x.b > y.b)));
    });
  }
}

void sweep_kernel(const SphereTree& a, const SphereTree& b, const Sweep& s, float rounding, SweepScratch* scratch,
                  SweptPairs* pairs) {
  switch (b.branching()) {
    case 4:
      return sweep_trees<4>(a, b, s, rounding, scratch, pairs);
    case 8:
      return sweep_trees<8>(a, b, s, rounding, scratch, pairs);
    default:
      return sweep_trees<16>(a, b, s, rounding, scratch, pairs);
  }
}

}  // namespace prescene::collision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace prescene::collision {

HWY_EXPORT(sweep_kernel);

void Sweep::set_bend(const ScrewMotion& motion, double from, double to) {
  // The second derivative of the place p at `from` is spin x (spin x p + drift): linear in p. Its length does not
  // change with time, so that p may be where the sphere is at any time: it is taken at the start of the motion.
  const double eighth = 0.125 * (to - from) * (to - from) * (1.0 + 1e-5);
  Eigen::Matrix3d spin;
  const Eigen::Vector3d& w = motion.spin();
  spin << 0, -w.z(), w.y(), w.z(), 0, -w.x(), -w.y(), w.x(), 0;
  const Eigen::Matrix3d by_place = eighth * spin * spin;
  const Eigen::Matrix3d by_centre = by_place * motion.start().rotation.toRotationMatrix();
  const Eigen::Vector3d offset = by_place * motion.start().translation + eighth * spin * motion.drift();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) bend[static_cast<std::size_t>(3 * i + j)] = static_cast<float>(by_centre(i, j));
    bend_offset[static_cast<std::size_t>(i)] = static_cast<float>(offset[i]);
  }
  turned = static_cast<float>(eighth * w.squaredNorm());
  bent = true;
}

void sweep(const SphereTree& a, const SphereTree& b, const Sweep& motion, SweepScratch* scratch, SweptPairs* pairs) {
  const std::size_t levels = static_cast<std::size_t>(a.depth()) + static_cast<std::size_t>(b.depth());
  const std::size_t most = levels * a.branching() * b.branching() + 1;
  if (scratch->entries().size() < most) scratch->entries().resize(most);
  // What rounding does to coordinates of B in A, at both ends.
  const auto length = [](const std::array<float, 3>& t) { return std::hypot(t[0], t[1], t[2]); };
  const float size = b.root().centre.norm() + b.root().radius;
  const float rounding = 2e-6F * (size + length(motion.start.translation) + length(motion.end.translation));
  HWY_DYNAMIC_DISPATCH(sweep_kernel)(a, b, motion, rounding, scratch, pairs);
}

}  // namespace prescene::collision
#endif
