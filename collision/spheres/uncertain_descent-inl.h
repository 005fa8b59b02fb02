// SPDX-License-Identifier: Apache-2.0
// Simultaneous descent of two sphere trees, the second of which may be anywhere within its error. Included once for
// each instruction set.
#include "lane_sums-inl.h"
#include "uncertain_lanes.h"

#if defined(PRESCENE_COLLISION_UNCERTAIN_DESCENT_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef PRESCENE_COLLISION_UNCERTAIN_DESCENT_INL_H_
#undef PRESCENE_COLLISION_UNCERTAIN_DESCENT_INL_H_
#else
#define PRESCENE_COLLISION_UNCERTAIN_DESCENT_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

HWY_BEFORE_NAMESPACE();
namespace prescene::collision::HWY_NAMESPACE {

/// Squared distance from the pivot.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V pivot_square(D d, const Swelling& s, V x, V y, V z) {
  const V ex = hn::Sub(x, hn::Set(d, s.pivot[0]));
  const V ey = hn::Sub(y, hn::Set(d, s.pivot[1]));
  const V ez = hn::Sub(z, hn::Set(d, s.pivot[2]));
  return dot3(ex, ey, ez, ex, ey, ez);
}

/// The children of a node of B in A's frame.
struct SwollenChildren {
  HWY_ALIGN float x[16];
  HWY_ALIGN float y[16];
  HWY_ALIGN float z[16];
  HWY_ALIGN float radius[16];
  HWY_ALIGN float reach[16];  ///< The radius and how far the error moves it.
};

template <std::size_t N>
HWY_INLINE void place(const float* lanes, const Swelling& s, float deviations, SwollenChildren* placed) {
  const hn::CappedTag<float, N> d;
  const auto moved = hn::Set(d, s.deviation * deviations + s.remainder);
  const auto moved_slope = hn::Set(d, s.deviation_slope * deviations + s.remainder_slope);
  const auto& r = s.X_AB.rotation;
  const auto& t = s.X_AB.translation;
  for (std::size_t i = 0; i < N; i += hn::Lanes(d)) {
    const auto x = hn::Load(d, lanes + i);
    const auto y = hn::Load(d, lanes + N + i);
    const auto z = hn::Load(d, lanes + 2 * N + i);
    const auto radius = hn::Load(d, lanes + 3 * N + i);
    const auto row = [&](std::size_t k) HWY_ATTR {
      return hn::Add(dot3(hn::Set(d, r[3 * k]), hn::Set(d, r[3 * k + 1]), hn::Set(d, r[3 * k + 2]), x, y, z),
                     hn::Set(d, t[k]));
    };
    const auto px = row(0);
    const auto py = row(1);
    const auto pz = row(2);
    const auto reach = hn::Add(radius, madd(pivot_square(d, s, px, py, pz), moved_slope, moved));
    hn::Store(px, d, placed->x + i);
    hn::Store(py, d, placed->y + i);
    hn::Store(pz, d, placed->z + i);
    hn::Store(radius, d, placed->radius + i);
    hn::Store(reach, d, placed->reach + i);
  }
}

/// Visits all pairs of spheres that the errors bring together. `sink` says how many standard deviations count
/// (deviations(), which may shrink on the way), takes a full buffer (flush(buffer)), and may end the descent (ended()).
template <std::size_t N, class Sink>
HWY_INLINE void descend(const SphereTree& tree_a, const SphereTree& tree_b, const Swelling& s, DescentStack* stack,
                        Sink& sink) {
  const hn::CappedTag<float, N> d;
  const SphereTree::Node* nodes_a = tree_a.nodes().data();
  const SphereTree::Node* nodes_b = tree_b.nodes().data();
  const std::size_t stride_a = tree_a.branching();
  PairBuffer& buffer = stack->buffer;
  buffer.size = 0;
  DescentStack::Entry* entries = stack->entries.data();
  std::size_t size = 0;
  entries[size++] = {0, 0};
  SwollenChildren placed;
  while (size > 0 && !sink.ended()) {
    const DescentStack::Entry at = entries[--size];
    const SphereTree::Node& a = nodes_a[at.a];
    const SphereTree::Node& b = nodes_b[at.b];
    const float* lanes_a = tree_a.lanes(at.a);
    place<N>(tree_b.lanes(at.b), s, sink.deviations(), &placed);
    const std::uint32_t used = (1U << b.count) - 1U;
    const bool both_bottom = a.is_bottom() && b.is_bottom();
    const std::size_t first = size;
    float deepest = std::numeric_limits<float>::infinity();
    std::size_t nearest = size;
    std::uint32_t any = 0;
    for (std::size_t i = 0; i < a.count; ++i) {
      const auto ax = hn::Set(d, lanes_a[i]);
      const auto ay = hn::Set(d, lanes_a[stride_a + i]);
      const auto az = hn::Set(d, lanes_a[2 * stride_a + i]);
      const auto ar = hn::Set(d, lanes_a[3 * stride_a + i]);
      std::uint32_t hits = 0;
      HWY_ALIGN float gaps[16];
      for (std::size_t k = 0; k < N; k += hn::Lanes(d)) {
        const auto x = hn::Load(d, placed.x + k);
        const auto y = hn::Load(d, placed.y + k);
        const auto z = hn::Load(d, placed.z + k);
        const auto dx = hn::Sub(x, ax);
        const auto dy = hn::Sub(y, ay);
        const auto dz = hn::Sub(z, az);
        const auto reach = hn::Add(hn::Load(d, placed.reach + k), ar);
        const auto square = dot3(dx, dy, dz, dx, dy, dz);
        const auto hit = hn::And(hn::Le(square, hn::Mul(reach, reach)), hn::Ge(reach, hn::Zero(d)));
        if (!both_bottom) {
          hn::Store(hn::Sub(square, hn::Mul(reach, reach)), d, gaps + k);
          hits |= mask_bits(d, hit) << k;
          continue;
        }
        const std::uint32_t bits = (mask_bits(d, hit) << k) & used;
        if (bits == 0) continue;
        // Unused lanes lie beyond all used ones, so that they are cut off by the count.
        const auto most = static_cast<std::size_t>(std::popcount(bits));
        // CompressStore would be many times slower on some processors than to compress and store.
        hn::StoreU(hn::Compress(x, hit), d, buffer.b[0].data() + buffer.size);
        hn::StoreU(hn::Compress(y, hit), d, buffer.b[1].data() + buffer.size);
        hn::StoreU(hn::Compress(z, hit), d, buffer.b[2].data() + buffer.size);
        hn::StoreU(hn::Compress(hn::Add(hn::Load(d, placed.radius + k), ar), hit), d,
                   buffer.radii.data() + buffer.size);
        hn::StoreU(ax, d, buffer.a[0].data() + buffer.size);
        hn::StoreU(ay, d, buffer.a[1].data() + buffer.size);
        hn::StoreU(az, d, buffer.a[2].data() + buffer.size);
        buffer.size += most;
      }
      if (both_bottom) continue;
      hits &= used;
      any |= hits;
      if (a.is_bottom()) continue;
      if (b.is_bottom()) {
        if (hits != 0) entries[size++] = {a.first + static_cast<std::uint32_t>(i), at.b};
        continue;
      }
      for (; hits != 0; hits &= hits - 1) {
        const auto k = static_cast<std::uint32_t>(std::countr_zero(hits));
        if (gaps[k] < deepest) {
          deepest = gaps[k];
          nearest = size;
        }
        entries[size++] = {a.first + static_cast<std::uint32_t>(i), b.first + k};
      }
    }
    if (both_bottom) {
      if (buffer.size >= sink.enough()) sink.flush(&buffer);
      continue;
    }
    if (a.is_bottom()) {
      for (; any != 0; any &= any - 1)
        entries[size++] = {at.a, b.first + static_cast<std::uint32_t>(std::countr_zero(any))};
    } else if (size > first) {
      std::swap(entries[nearest < size ? nearest : first], entries[size - 1]);  // the deepest pair first
    }
  }
  if (!sink.ended()) sink.flush(&buffer);
}

template <class Sink>
HWY_INLINE void descend(const SphereTree& a, const SphereTree& b, const Swelling& s, DescentStack* stack, Sink& sink) {
  switch (b.branching()) {
    case 4:
      return descend<4>(a, b, s, stack, sink);
    case 8:
      return descend<8>(a, b, s, stack, sink);
    default:
      return descend<16>(a, b, s, stack, sink);
  }
}

using Lanes = hn::CappedTag<float, kPairLanes>;
using V = hn::Vec<Lanes>;

/// A vector of pairs.
struct PairGeometry {
  V ax, ay, az;
  V px, py, pz;
  V nx, ny, nz;  ///< From a to p.
  V cx, cy, cz;  ///< p x n.
  V distance;
  V radii;
  V pivot_square;
  V deviation;  ///< Along n.

  HWY_INLINE PairGeometry(Lanes d, const Swelling& s, const float* a0, const float* a1, const float* a2,
                          const float* b0, const float* b1, const float* b2, const float* r)
      : ax(hn::LoadU(d, a0)),
        ay(hn::LoadU(d, a1)),
        az(hn::LoadU(d, a2)),
        px(hn::LoadU(d, b0)),
        py(hn::LoadU(d, b1)),
        pz(hn::LoadU(d, b2)),
        radii(hn::LoadU(d, r)) {
    const V gx = hn::Sub(px, ax);
    const V gy = hn::Sub(py, ay);
    const V gz = hn::Sub(pz, az);
    distance = hn::Sqrt(dot3(gx, gy, gz, gx, gy, gz));
    // Centres at one place have no direction: any does.
    const V tiny = hn::Set(d, 1e-30F);
    const auto apart = hn::Gt(distance, tiny);
    const V inverse = hn::Div(hn::Set(d, 1.0F), hn::Max(distance, tiny));
    nx = hn::IfThenElse(apart, hn::Mul(gx, inverse), hn::Set(d, 1.0F));
    ny = hn::IfThenElseZero(apart, hn::Mul(gy, inverse));
    nz = hn::IfThenElseZero(apart, hn::Mul(gz, inverse));
    cx = hn::Sub(hn::Mul(py, nz), hn::Mul(pz, ny));
    cy = hn::Sub(hn::Mul(pz, nx), hn::Mul(px, nz));
    cz = hn::Sub(hn::Mul(px, ny), hn::Mul(py, nx));
    pivot_square = HWY_NAMESPACE::pivot_square(d, s, px, py, pz);
    // |factor^T (c, n)|
    const V m[6] = {cx, cy, cz, nx, ny, nz};
    V square = hn::Zero(d);
    for (std::size_t j = 0; j < 6; ++j) {
      V u = hn::Zero(d);
      for (std::size_t i = j; i < 6; ++i) u = madd(hn::Set(d, s.factor[i * (i + 1) / 2 + j]), m[i], u);
      square = madd(u, u, square);
    }
    deviation = hn::Sqrt(square);
  }
};

template <class Pairs>
HWY_INLINE PairGeometry geometry_of(const Pairs& pairs, const Swelling& s, std::size_t i) {
  return {Lanes(),
          s,
          pairs.a[0].data() + i,
          pairs.a[1].data() + i,
          pairs.a[2].data() + i,
          pairs.b[0].data() + i,
          pairs.b[1].data() + i,
          pairs.b[2].data() + i,
          pairs.radii.data() + i};
}

}  // namespace prescene::collision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
