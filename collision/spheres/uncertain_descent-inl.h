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
#include <utility>

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

using Lanes = hn::CappedTag<float, kPairLanes>;
using IndexLanes = hn::RebindToUnsigned<Lanes>;
using V = hn::Vec<Lanes>;

/// All pairs of the children of two nodes of N lanes are met in order, child by child of A. A vector holds kRows of A's
/// children, each with all of B's, or a part of B's with one of A's.
template <std::size_t N>
inline constexpr std::size_t kRows = hn::MaxLanes(Lanes()) > N ? hn::MaxLanes(Lanes()) / N : 1;
/// Lanes of B's children in a vector.
template <std::size_t N>
inline constexpr std::size_t kStep = hn::MaxLanes(Lanes()) > N ? N : hn::MaxLanes(Lanes());

/// The children of a node of B in A's frame, repeated for each row of a vector.
template <std::size_t N>
struct SwollenChildren {
  static constexpr std::size_t kVectors = N / kStep<N>;
  V x[kVectors];
  V y[kVectors];
  V z[kVectors];
  V radius[kVectors];
  V reach[kVectors];  ///< The radius and how far the error moves it; of unused lanes, below any radius.
};

HWY_ALIGN inline constexpr float kLaneNumbers[16] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};

/// N numbers, again and again.
template <std::size_t N>
HWY_INLINE V repeated(const float* numbers) {
  const Lanes d;
  if constexpr (kRows<N> == 1) return hn::Load(d, numbers);
#if HWY_TARGET != HWY_SCALAR
  if constexpr (kRows < N >> 1 && N == 4) return hn::LoadDup128(d, numbers);
  if constexpr (kRows < N >> 1 && N == 8) {
    const hn::Half<Lanes> half;
    const auto part = hn::Load(half, numbers);
    return hn::Combine(d, part, part);
  }
#endif
}

/// Of a row of numbers, `row` and the following ones of a vector, each for N lanes. `row` is a multiple of kRows.
template <std::size_t N>
HWY_INLINE V spread(const float* numbers, std::size_t row) {
  const Lanes d;
  if constexpr (kRows<N> == 1) {
    return hn::Set(d, numbers[row]);
  } else if constexpr (kRows<N> == 2) {
    return hn::IfThenElse(hn::FirstN(d, N), hn::Set(d, numbers[row]), hn::Set(d, numbers[row + 1]));
  } else {
    const hn::RebindToSigned<Lanes> index;
    return hn::TableLookupLanes(hn::LoadDup128(d, numbers + row),
                                hn::IndicesFromVec(d, hn::ShiftRight<2>(hn::Iota(index, 0))));
  }
}

/// By how much the radius of a sphere is larger, its centre at a squared distance w from the pivot: constant + slope w,
/// m.
struct Growth {
  float constant;
  float slope;
};
/// To all that the sphere reaches with errors of so many standard deviations.
HWY_INLINE Growth growth_by(const Swelling& s, float deviations) {
  return {s.deviation * deviations + s.remainder, s.deviation_slope * deviations + s.remainder_slope};
}

template <std::size_t N>
HWY_INLINE SwollenChildren<N> place(const float* lanes, std::uint32_t count, const Swelling& s, const Growth& growth) {
  const Lanes d;
  const V moved = hn::Set(d, growth.constant);
  const V moved_slope = hn::Set(d, growth.slope);
  const auto& r = s.X_AB.rotation;
  const auto& t = s.X_AB.translation;
  SwollenChildren<N> placed;
  for (std::size_t v = 0; v < SwollenChildren<N>::kVectors; ++v) {
    const std::size_t i = v * kStep<N>;
    const V x = repeated<N>(lanes + i);
    const V y = repeated<N>(lanes + N + i);
    const V z = repeated<N>(lanes + 2 * N + i);
    const auto row = [&](std::size_t k) HWY_ATTR {
      return hn::Add(dot3(hn::Set(d, r[3 * k]), hn::Set(d, r[3 * k + 1]), hn::Set(d, r[3 * k + 2]), x, y, z),
                     hn::Set(d, t[k]));
    };
    placed.x[v] = row(0);
    placed.y[v] = row(1);
    placed.z[v] = row(2);
    placed.radius[v] = repeated<N>(lanes + 3 * N + i);
    const V square = pivot_square(d, s, placed.x[v], placed.y[v], placed.z[v]);
    const V swollen = hn::Add(placed.radius[v], madd(square, moved_slope, moved));
    const auto used = hn::Lt(repeated<N>(kLaneNumbers + i), hn::Set(d, static_cast<float>(count)));
    placed.reach[v] = hn::IfThenElse(used, swollen, hn::Set(d, -1e30F));
  }
  return placed;
}

/// Some pairs of one of A's children, or of kRows of them, and B's children.
struct MetPairs {
  V ax, ay, az;
  V x, y, z;
  V radii;
  V gap;  ///< Squared distance less the square of the reach.
  hn::Mask<Lanes> meet;
};

/// Calls met(row of A, lane of B, pairs) where some pairs are within reach.
template <std::size_t N, class Met>
HWY_INLINE void for_met(const float* lanes_a, std::size_t stride_a, std::uint32_t count_a, const SwollenChildren<N>& b,
                        const Met& met) {
  const Lanes d;
  for (std::size_t i = 0; i < count_a; i += kRows<N>) {
    MetPairs pairs;
    pairs.ax = spread<N>(lanes_a, i);
    pairs.ay = spread<N>(lanes_a + stride_a, i);
    pairs.az = spread<N>(lanes_a + 2 * stride_a, i);
    const V ar = spread<N>(lanes_a + 3 * stride_a, i);
    for (std::size_t v = 0; v < SwollenChildren<N>::kVectors; ++v) {
      pairs.x = b.x[v];
      pairs.y = b.y[v];
      pairs.z = b.z[v];
      const V dx = hn::Sub(pairs.x, pairs.ax);
      const V dy = hn::Sub(pairs.y, pairs.ay);
      const V dz = hn::Sub(pairs.z, pairs.az);
      const V reach = hn::Add(b.reach[v], ar);
      pairs.gap = hn::Sub(dot3(dx, dy, dz, dx, dy, dz), hn::Mul(reach, reach));
      pairs.meet = hn::And(hn::Le(pairs.gap, hn::Zero(d)), hn::Ge(reach, hn::Zero(d)));
      if (hn::AllFalse(d, pairs.meet)) continue;
      pairs.radii = hn::Add(b.radius[v], ar);
      met(static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(v * kStep<N>), pairs);
    }
  }
}

/// Pairs of nodes that are yet to be looked at, with room for what one pair of nodes can add.
class NodePairs {
 public:
  explicit NodePairs(DescentStack::Pairs* memory) : memory_(memory) { make_room(); }

  std::size_t size() const { return size_; }
  void clear() { size_ = 0; }
  std::uint32_t a(std::size_t i) const { return a_[i]; }
  std::uint32_t b(std::size_t i) const { return b_[i]; }
  void pop() { --size_; }
  HWY_INLINE void make_room() {
    if (size_ + kRoom > memory_->a.size() || size_ == 0) grow();
  }
  void push(std::uint32_t a, std::uint32_t b) {
    a_[size_] = a;
    b_[size_] = b;
    gap_[size_] = 0.0F;
    ++size_;
  }
  /// The pairs of children first_a + i and first_b + k of the lanes that meet.
  template <std::size_t N, bool kGaps>
  HWY_INLINE void push_lanes(const MetPairs& pairs, std::uint32_t first_a, std::uint32_t first_b) {
    const Lanes d;
    const IndexLanes index;
    const auto meet = hn::RebindMask(index, pairs.meet);
    const auto lane = hn::Iota(index, 0);
    auto a = hn::Set(index, first_a);
    auto b = hn::Add(lane, hn::Set(index, first_b));
    if constexpr (kRows<N> == 1) {
      hn::StoreU(a, index, a_ + size_);
    } else {
      constexpr int kShift = std::countr_zero(N);
      const auto row = hn::ShiftRight<kShift>(lane);
      a = hn::Add(a, row);
      b = hn::Sub(b, hn::ShiftLeft<kShift>(row));
      hn::StoreU(hn::Compress(a, meet), index, a_ + size_);
    }
    hn::StoreU(hn::Compress(b, meet), index, b_ + size_);
    if constexpr (kGaps) hn::StoreU(hn::Compress(pairs.gap, pairs.meet), d, gap_ + size_);
    size_ += hn::CountTrue(d, pairs.meet);
  }
  /// Brings the deepest of the pairs from `first` on to the top.
  void deepest_on_top(std::size_t first) {
    if (size_ <= first) return;
    const auto deepest = static_cast<std::size_t>(std::min_element(gap_ + first, gap_ + size_) - gap_);
    std::swap(a_[deepest], a_[size_ - 1]);
    std::swap(b_[deepest], b_[size_ - 1]);
  }

 private:
  static constexpr std::size_t kRoom = SphereTree::kMostBranching * SphereTree::kMostBranching + kPairLanes;

  void grow() {
    memory_->reserve(size_ + kRoom);
    a_ = memory_->a.data();
    b_ = memory_->b.data();
    gap_ = memory_->gap.data();
  }

  DescentStack::Pairs* memory_;
  std::uint32_t* a_ = nullptr;
  std::uint32_t* b_ = nullptr;
  float* gap_ = nullptr;
  std::size_t size_ = 0;
};

/// Appends pairs of spheres.
template <std::size_t N>
HWY_INLINE void append(const MetPairs& pairs, PairBuffer* buffer) {
  const Lanes d;
  const std::size_t at = buffer->size;
  // CompressStore would be many times slower on some processors than to compress and store.
  const auto keep = [&](V v, PairBuffer::Numbers& numbers)
                        HWY_ATTR { hn::StoreU(hn::Compress(v, pairs.meet), d, numbers.data() + at); };
  keep(pairs.x, buffer->b[0]);
  keep(pairs.y, buffer->b[1]);
  keep(pairs.z, buffer->b[2]);
  keep(pairs.radii, buffer->radii);
  if constexpr (kRows<N> == 1) {  // the same in all lanes
    hn::StoreU(pairs.ax, d, buffer->a[0].data() + at);
    hn::StoreU(pairs.ay, d, buffer->a[1].data() + at);
    hn::StoreU(pairs.az, d, buffer->a[2].data() + at);
  } else {
    keep(pairs.ax, buffer->a[0]);
    keep(pairs.ay, buffer->a[1]);
    keep(pairs.az, buffer->a[2]);
  }
  buffer->size += hn::CountTrue(d, pairs.meet);
}

/// Meets the children of two nodes: pairs of spheres go to the buffer, pairs of nodes to `next`.
template <std::size_t N, class Sink>
HWY_INLINE void meet_children(const SphereTree& tree_a, const SphereTree& tree_b, std::uint32_t at_a,
                              std::uint32_t at_b, const Swelling& s, Sink& sink, PairBuffer* buffer, NodePairs* next) {
  const SphereTree::Node a = tree_a.nodes().data()[at_a];
  const SphereTree::Node b = tree_b.nodes().data()[at_b];
  const std::size_t stride_a = tree_a.branching();  // 4, 8 or 16: a multiple of kRows
  const float* lanes_a = tree_a.lanes(at_a);
  const SwollenChildren<N> placed = place<N>(tree_b.lanes(at_b), b.count, s, sink.growth(b.is_bottom()));
  if (a.is_bottom() && b.is_bottom()) {
    for_met<N>(lanes_a, stride_a, a.count, placed,
               [&](std::uint32_t, std::uint32_t, const MetPairs& pairs) HWY_ATTR { append<N>(pairs, buffer); });
    if (buffer->size >= sink.enough()) sink.flush(buffer);
    return;
  }
  next->make_room();
  if (!a.is_bottom() && !b.is_bottom()) {
    const std::size_t first = next->size();
    for_met<N>(lanes_a, stride_a, a.count, placed,
               [&](std::uint32_t i, std::uint32_t k, const MetPairs& pairs)
                   HWY_ATTR { next->push_lanes<N, Sink::kDeepestFirst>(pairs, a.first + i, b.first + k); });
    if constexpr (Sink::kDeepestFirst) next->deepest_on_top(first);
    return;
  }
  std::uint32_t met = 0;  // of the node that is not at the bottom
  for_met<N>(lanes_a, stride_a, a.count, placed, [&](std::uint32_t i, std::uint32_t k, const MetPairs& pairs) HWY_ATTR {
    std::uint32_t bits = mask_bits(Lanes(), pairs.meet);
    for (std::uint32_t row = 0; row < kRows<N>; ++row, bits >>= kStep<N> % 16) {
      const std::uint32_t of_row = bits & ((1U << kStep<N>)-1U);
      met |= a.is_bottom() ? of_row << k : (of_row != 0 ? 1U << (i + row) : 0U);
    }
  });
  for (; met != 0; met &= met - 1) {
    const auto child = static_cast<std::uint32_t>(std::countr_zero(met));
    if (a.is_bottom()) {
      next->push(at_a, b.first + child);
    } else {
      next->push(a.first + child, at_b);
    }
  }
}

/// Visits all pairs of spheres that the errors bring together. `sink` says how much larger spheres count (growth(true))
/// and those about others (growth(false)), which may shrink on the way, takes the pairs (flush(buffer)) when there are
/// enough(), and may end the descent (ended()). With kDeepestFirst that helps; without, a level is done at a time: what
/// a pair of nodes needs then never waits for the pair before.
template <std::size_t N, class Sink>
HWY_INLINE void descend(const SphereTree& a, const SphereTree& b, const Swelling& s, DescentStack* stack, Sink& sink) {
  PairBuffer& buffer = stack->buffer;
  buffer.size = 0;
  NodePairs open(&stack->open);
  open.push(0, 0);
  if constexpr (Sink::kDeepestFirst) {
    while (open.size() > 0 && !sink.ended()) {
      const std::size_t top = open.size() - 1;
      const std::uint32_t at_a = open.a(top);
      const std::uint32_t at_b = open.b(top);
      open.pop();
      meet_children<N>(a, b, at_a, at_b, s, sink, &buffer, &open);
    }
  } else {
    NodePairs below(&stack->below);
    NodePairs* level = &open;
    NodePairs* next = &below;
    for (; level->size() > 0; std::swap(level, next)) {
      next->clear();
      for (std::size_t i = 0; i < level->size(); ++i)
        meet_children<N>(a, b, level->a(i), level->b(i), s, sink, &buffer, next);
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

/// How far pairs are from touching.
struct PairMargins {
  V deviations;  ///< Standard deviations along n without which they cannot touch, the remainder against them.
  V sure;        ///< m; not negative: they touch wherever the centre is within its ball.
};

HWY_INLINE PairMargins margins_of(const PairGeometry& g, const Swelling& s) {
  const Lanes d;
  const V missed = madd(g.pivot_square, hn::Set(d, s.remainder_slope), hn::Set(d, s.remainder));
  const V gap = hn::Sub(g.distance, g.radii);
  const V bound = madd(g.pivot_square, hn::Set(d, s.deviation_slope), hn::Set(d, s.deviation));
  return {hn::Div(hn::Sub(gap, missed), hn::Max(g.deviation, hn::Set(d, 1e-30F))),
          hn::Sub(hn::Sub(hn::Neg(gap), missed), hn::Mul(bound, hn::Set(d, s.ball_radius)))};
}

}  // namespace prescene::collision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
