// SPDX-License-Identifier: Apache-2.0
#include "uncertain_lanes.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "uncertain_lanes.cc"
#include <hwy/foreach_target.h>
// After foreach_target.h, which includes this file once for each instruction set.
#include <hwy/contrib/math/math-inl.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace prescene::collision::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Products and sums are rounded one by one, so that every instruction set keeps the same pairs.
template <class V>
HWY_INLINE V madd(V a, V b, V c) {
  return hn::Add(hn::Mul(a, b), c);
}
template <class V>
HWY_INLINE V dot3(V ax, V ay, V az, V bx, V by, V bz) {
  return madd(az, bz, madd(ay, by, hn::Mul(ax, bx)));
}

template <class D>
HWY_INLINE std::uint32_t mask_bits(D d, hn::Mask<D> mask) {
  std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(d, mask, bytes);
  return static_cast<std::uint32_t>(bytes[0]) | (static_cast<std::uint32_t>(bytes[1]) << 8U);
}

/// Squared distance from the pivot.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V pivot_square(D d, const Swelling& s, V x, V y, V z) {
  const V ex = hn::Sub(x, hn::Set(d, s.pivot[0]));
  const V ey = hn::Sub(y, hn::Set(d, s.pivot[1]));
  const V ez = hn::Sub(z, hn::Set(d, s.pivot[2]));
  return dot3(ex, ey, ez, ex, ey, ez);
}

/// The children of a node of B in A's frame.
struct PlacedChildren {
  HWY_ALIGN float x[16];
  HWY_ALIGN float y[16];
  HWY_ALIGN float z[16];
  HWY_ALIGN float radius[16];
  HWY_ALIGN float reach[16];  ///< The radius and how far the error moves it.
};

template <std::size_t N>
HWY_INLINE void place(const float* lanes, const Swelling& s, float deviations, PlacedChildren* placed) {
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
  PlacedChildren placed;
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
struct Geometry {
  V ax, ay, az;
  V px, py, pz;
  V nx, ny, nz;  ///< From a to p.
  V cx, cy, cz;  ///< p x n.
  V distance;
  V radii;
  V pivot_square;
  V deviation;  ///< Along n.

  HWY_INLINE Geometry(Lanes d, const Swelling& s, const float* a0, const float* a1, const float* a2, const float* b0,
                      const float* b1, const float* b2, const float* r)
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
HWY_INLINE Geometry geometry_of(const Pairs& pairs, const Swelling& s, std::size_t i) {
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

/// Keeps the pairs with the least margins.
class CriticalSink {
 public:
  CriticalSink(const Swelling& s, CriticalPairs* critical) : s_(s), critical_(critical), limit_(s.region_radius) {}

  float deviations() const { return std::max(0.0F, limit_); }
  bool ended() const { return ended_; }
  std::size_t enough() const { return 32; }

  void flush(PairBuffer* buffer) {
    const Lanes d;
    for (std::size_t i = 0; i < buffer->size && !ended_; i += hn::Lanes(d)) {
      const Geometry g = geometry_of(*buffer, s_, i);
      const V missed = madd(g.pivot_square, hn::Set(d, s_.remainder_slope), hn::Set(d, s_.remainder));
      const V gap = hn::Sub(hn::Sub(g.distance, g.radii), missed);
      const V bound = madd(g.pivot_square, hn::Set(d, s_.deviation_slope), hn::Set(d, s_.deviation));
      const V sure = hn::Sub(hn::Sub(hn::Sub(g.radii, g.distance), missed), hn::Mul(bound, hn::Set(d, s_.ball_radius)));
      HWY_ALIGN float margins[kPairLanes];
      HWY_ALIGN float sures[kPairLanes];
      hn::Store(hn::Div(gap, hn::Max(g.deviation, hn::Set(d, 1e-30F))), d, margins);
      hn::Store(sure, d, sures);
      const std::size_t count = std::min(hn::Lanes(d), buffer->size - i);
      for (std::size_t k = 0; k < count && !ended_; ++k) {
        if (margins[k] >= limit_ && sures[k] < 0.0F) continue;
        keep(*buffer, i + k, std::clamp(margins[k], -1e6F, 1e6F), sures[k] >= 0.0F);
      }
    }
    buffer->size = 0;
  }

  void finish() {
    critical_->complete = !ended_ && !full_;
    critical_->left_out = ended_ ? -std::numeric_limits<float>::infinity() : limit_;
  }

 private:
  void keep(const PairBuffer& buffer, std::size_t i, float margin, bool certain) {
    SpherePairs<CriticalPairs::kMost>& kept = critical_->pairs;
    std::size_t place = kept.size;
    if (kept.size == CriticalPairs::kMost) {
      place = worst_;
    } else {
      ++kept.size;
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
      kept.a[axis][place] = buffer.a[axis][i];
      kept.b[axis][place] = buffer.b[axis][i];
    }
    kept.radii[place] = buffer.radii[i];
    critical_->margin[place] = margin;
    if (certain) {
      critical_->certain = true;
      critical_->certain_pair = place;
      ended_ = true;
    }
    if (kept.size < CriticalPairs::kMost) return;
    const float* margins = critical_->margin.data();
    worst_ = static_cast<std::size_t>(std::max_element(margins, margins + CriticalPairs::kMost) - margins);
    full_ = true;
    limit_ = std::min(limit_, margins[worst_]);
    // All touch at the mean: finding more of them would take as long as finding all.
    if (limit_ <= 0.0F) ended_ = true;
  }

  const Swelling& s_;
  CriticalPairs* critical_;
  float limit_;
  std::size_t worst_ = 0;
  bool full_ = false;
  bool ended_ = false;
};

void find_critical_lanes(const SphereTree& a, const SphereTree& b, const Swelling& s, DescentStack* stack,
                         CriticalPairs* critical) {
  CriticalSink sink(s, critical);
  descend(a, b, s, stack, sink);
  sink.finish();
}

/// Joins the intervals [low, high] of `count` pairs (a whole number of vectors; empty ones are at infinity).
HWY_INLINE std::size_t join(const float* low, const float* high, std::size_t count, float* joined_low,
                            float* joined_high) {
  const Lanes d;
  const V far = hn::Set(d, 1e30F);
  float from = -2e30F;
  for (std::size_t found = 0;; ++found) {
    // The next interval that begins beyond what is joined so far.
    V next = far;
    for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
      const V l = hn::Load(d, low + i);
      next = hn::Min(next, hn::IfThenElse(hn::Gt(l, hn::Set(d, from)), l, far));
    }
    const float begin = hn::GetLane(hn::MinOfLanes(d, next));
    if (begin >= 1e30F) return found;
    float end = begin;
    for (bool grown = true; grown;) {
      V most = hn::Set(d, end);
      for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
        const V l = hn::Load(d, low + i);
        most = hn::Max(most, hn::IfThenElse(hn::Le(l, hn::Set(d, end)), hn::Load(d, high + i), most));
      }
      const float longest = hn::GetLane(hn::MaxOfLanes(d, most));
      grown = longest > end;
      end = longest;
    }
    if (found + 1 == TouchingIntervals::kMost) {  // Rare: the rest as one.
      V most = hn::Set(d, end);
      for (std::size_t i = 0; i < count; i += hn::Lanes(d)) most = hn::Max(most, hn::Load(d, high + i));
      joined_low[found] = begin;
      joined_high[found] = hn::GetLane(hn::MaxOfLanes(d, most));
      return found + 1;
    }
    joined_low[found] = begin;
    joined_high[found] = end;
    from = end;
  }
}

void intersect_lanes(const CriticalPairs& critical, const Swelling& s, const ErrorLines& lines, bool endless,
                     TouchingIntervals* intervals) {
  const Lanes d;
  const std::size_t size = critical.pairs.size;
  const std::size_t whole = (size + hn::Lanes(d) - 1) / hn::Lanes(d) * hn::Lanes(d);
  HWY_ALIGN float low[ErrorLines::kCount][CriticalPairs::kMost + kPairLanes];
  HWY_ALIGN float high[ErrorLines::kCount][CriticalPairs::kMost + kPairLanes];
  HWY_ALIGN float position[kPairLanes];
  for (std::size_t i = 0; i < kPairLanes; ++i) position[i] = static_cast<float>(i);
  const V far = hn::Set(d, 1e30F);
  for (std::size_t i = 0; i < whole; i += hn::Lanes(d)) {
    const Geometry g = geometry_of(critical.pairs, s, i);
    const auto used = hn::Lt(hn::Load(d, position), hn::Set(d, static_cast<float>(size - i)));
    // Columns of the displacement at p: phi x p + tau with (phi, tau) = factor * z.
    V move[3][6];
    for (std::size_t j = 0; j < 6; ++j) {
      V error[6];
      for (std::size_t k = 0; k < 6; ++k) error[k] = k >= j ? hn::Set(d, s.factor[k * (k + 1) / 2 + j]) : hn::Zero(d);
      move[0][j] = hn::Add(error[3], hn::Sub(hn::Mul(error[1], g.pz), hn::Mul(error[2], g.py)));
      move[1][j] = hn::Add(error[4], hn::Sub(hn::Mul(error[2], g.px), hn::Mul(error[0], g.pz)));
      move[2][j] = hn::Add(error[5], hn::Sub(hn::Mul(error[0], g.py), hn::Mul(error[1], g.px)));
    }
    const auto moved = [&](std::size_t axis, const std::array<float, 6>& z) HWY_ATTR {
      V sum = hn::Zero(d);
      for (std::size_t j = 0; j < 6; ++j) sum = madd(move[axis][j], hn::Set(d, z[j]), sum);
      return sum;
    };
    const V vx = moved(0, lines.direction);
    const V vy = moved(1, lines.direction);
    const V vz = moved(2, lines.direction);
    const V speed = hn::Max(dot3(vx, vy, vz, vx, vy, vz), hn::Set(d, 1e-30F));
    const V inverse = hn::Div(hn::Set(d, 1.0F), speed);
    for (std::size_t line = 0; line < ErrorLines::kCount; ++line) {
      const V x = hn::Add(hn::Sub(g.px, g.ax), moved(0, lines.start[line]));
      const V y = hn::Add(hn::Sub(g.py, g.ay), moved(1, lines.start[line]));
      const V z = hn::Add(hn::Sub(g.pz, g.az), moved(2, lines.start[line]));
      const V along = dot3(x, y, z, vx, vy, vz);
      const V length = hn::Sqrt(dot3(x, y, z, x, y, z));
      const V outside = hn::Mul(hn::Sub(length, g.radii), hn::Add(length, g.radii));
      const V discriminant = hn::Sub(hn::Mul(along, along), hn::Mul(speed, outside));
      const auto meets = hn::And(used, hn::Ge(discriminant, hn::Zero(d)));
      const V root = hn::Sqrt(hn::Max(discriminant, hn::Zero(d)));
      const V begin = hn::Mul(hn::Sub(hn::Neg(along), root), inverse);
      const V end = endless ? far : hn::Mul(hn::Sub(root, along), inverse);
      hn::Store(hn::IfThenElse(meets, hn::Max(begin, hn::Set(d, -1e30F)), far), d, low[line] + i);
      hn::Store(hn::IfThenElse(meets, hn::Min(end, far), hn::Neg(far)), d, high[line] + i);
    }
  }
  for (std::size_t line = 0; line < ErrorLines::kCount; ++line) {
    intervals->count[line] =
        join(low[line], high[line], whole, intervals->low[line].data(), intervals->high[line].data());
  }
}

/// Adds up WrenchSums, a vector a number.
class WrenchSink {
 public:
  WrenchSink(const Swelling& s, float reach) : s_(s), reach_(reach) {
    for (auto& lanes : sums_) std::fill(std::begin(lanes), std::end(lanes), 0.0F);
    for (auto& lanes : local_) std::fill(std::begin(lanes), std::end(lanes), 0.0F);
    for (geometry::Matrix6d& m : bending_) m.setZero();
  }

  float deviations() const { return reach_; }
  bool ended() const { return false; }
  std::size_t enough() const { return PairBuffer::kCapacity - 256; }

  void flush(PairBuffer* buffer) {
    const Lanes d;
    for (std::size_t i = 0; i < buffer->size; i += hn::Lanes(d)) {
      const std::size_t rest = buffer->size - i;
      add(geometry_of(*buffer, s_, i), hn::FirstN(d, rest));
    }
    if (buffer->size > 0) gather();
    buffer->size = 0;
  }

  void finish(WrenchSums* result) const {
    for (std::size_t i = 0; i < WrenchSums::kCount; ++i) result->sums[i] = total(sums_[i]);
    result->pairs = total(sums_[kPairs]);
    result->bending = bending_;
  }

 private:
  static constexpr std::size_t kPairs = WrenchSums::kCount;

  static double total(const float* lanes) {
    double sum = 0.0;
    for (std::size_t k = 0; k < kPairLanes; ++k) sum += static_cast<double>(lanes[k]);
    return sum;
  }

  void gather() {
    LocalSums local;
    for (std::size_t i = 0; i < LocalSums::kCount; ++i) local.sums[i] = total(local_[i]);
    for (auto& lanes : local_) std::fill(std::begin(lanes), std::end(lanes), 0.0F);
    add_bending(local, &bending_);
  }

  HWY_INLINE static void accumulate(float* sum, V value) {
    const Lanes d;
    hn::Store(hn::Add(hn::Load(d, sum), value), d, sum);
  }

  HWY_INLINE void add(const Geometry& g, hn::Mask<Lanes> used) {
    const Lanes d;
    const V zero = hn::Zero(d);
    const V one = hn::Set(d, 1.0F);
    const V half = hn::Set(d, 0.5F);
    // The centres' distance is longer on average than that of the mean centres, by the motion across n.
    const V across = hn::Max(zero, hn::Sub(trace(g), hn::Mul(g.deviation, g.deviation)));
    const V distance = hn::Max(hn::Sqrt(madd(g.distance, g.distance, across)), hn::Set(d, 1e-20F));
    const V inverse = hn::Div(one, distance);
    const V aligned = hn::Mul(g.distance, inverse);
    const V sigma = hn::Max(g.deviation, hn::Set(d, 1e-20F));
    const V gap = hn::Sub(distance, g.radii);
    const V margin = hn::Max(hn::Min(hn::Div(gap, sigma), hn::Set(d, 12.0F)), hn::Set(d, -12.0F));
    // Density and tail of the normal distribution [Abramowitz and Stegun 1964, 26.2.17]: within 1e-7.
    const V density =
        hn::Mul(hn::Set(d, 0.3989422804F), hn::Exp(d, hn::Mul(hn::Set(d, -0.5F), hn::Mul(margin, margin))));
    const V t = hn::Div(one, madd(hn::Set(d, 0.2316419F), hn::Abs(margin), one));
    V polynomial = hn::Set(d, 1.330274429F);
    for (const float c : {-1.821255978F, 1.781477937F, -0.356563782F, 0.319381530F})
      polynomial = madd(polynomial, t, hn::Set(d, c));
    const V small = hn::Mul(hn::Mul(density, t), polynomial);
    const V touching = hn::IfThenElse(hn::Lt(margin, zero), hn::Sub(one, small), small);
    const V depth = hn::Max(zero, hn::Sub(hn::Mul(sigma, density), hn::Mul(gap, touching)));
    const V f0 = hn::IfThenElseZero(used, hn::Mul(hn::Mul(half, depth), aligned));
    const V f1 = hn::IfThenElseZero(used, hn::Mul(half, touching));
    const V w = hn::Mul(f0, inverse);  // the force also turns with n

    const V m[6] = {g.cx, g.cy, g.cz, g.nx, g.ny, g.nz};
    for (std::size_t k = 0; k < 6; ++k) accumulate(sums_[WrenchSums::kMean + k], hn::Mul(f0, m[(k + 3) % 6]));
    std::size_t index = WrenchSums::kNormal;
    const V normal = hn::Add(f1, w);
    for (std::size_t i = 0; i < 6; ++i) {
      const V scaled = hn::Mul(normal, m[i]);
      for (std::size_t j = i; j < 6; ++j) accumulate(sums_[index++], hn::Mul(scaled, m[j]));
    }
    const V p[3] = {g.px, g.py, g.pz};
    const V a[3] = {g.ax, g.ay, g.az};
    index = WrenchSums::kSideways;
    accumulate(sums_[index++], w);
    for (const V& coordinate : p) accumulate(sums_[index++], hn::Mul(w, coordinate));
    for (const V& coordinate : a) accumulate(sums_[index++], hn::Mul(w, coordinate));
    for (const V& of_a : a) {
      const V scaled = hn::Mul(w, of_a);
      for (const V& of_p : p) accumulate(sums_[index++], hn::Mul(scaled, of_p));
    }
    accumulate(sums_[kPairs], hn::IfThenElseZero(used, touching));

    const V b = hn::Neg(hn::Mul(hn::Add(f1, w), inverse));
    for (std::size_t i = 0; i < 3; ++i) accumulate(local_[LocalSums::kPlace + i], hn::Mul(f1, p[i]));
    accumulate(local_[LocalSums::kWeight], f1);
    const V n[3] = {g.nx, g.ny, g.nz};
    index = LocalSums::kCubic;
    for (std::size_t i = 0; i < 3; ++i) {
      const V once = hn::Mul(b, n[i]);
      accumulate(local_[LocalSums::kBent + i], once);
      for (std::size_t j = i; j < 3; ++j) {
        const V twice = hn::Mul(once, n[j]);
        for (std::size_t k = j; k < 3; ++k) accumulate(local_[index++], hn::Mul(twice, n[k]));
      }
    }

    // Pairs that surely touch or surely don't have no kink.
    const auto kinked = hn::And(used, hn::Lt(hn::Abs(margin), hn::Set(d, reach_)));
    if (hn::AllFalse(d, kinked)) return;
    // The variance of x = max(0, -(gap + sigma z)) is the sum of the squares of its derivatives' means over factorials,
    // each times sigma^n: touching, density, -margin density, (margin^2 - 1) density... Pairs are correlated to the
    // n-th power of what they have in common. The second order holds the fourth, too, where its sign is the same; the
    // rest is kept as if it were of first order, with the sign of the third, so that it cancels between pairs before
    // and after their kinks.
    const V square =
        hn::Sub(hn::Mul(madd(gap, gap, hn::Mul(sigma, sigma)), touching), hn::Mul(hn::Mul(sigma, gap), density));
    const V linear = hn::Mul(sigma, touching);
    const V bent = hn::Mul(sigma, density);
    const V fourth = hn::Mul(bent, hn::Max(zero, hn::Sub(hn::Mul(margin, margin), one)));
    const V even = hn::Add(hn::Mul(bent, bent), hn::Mul(hn::Set(d, 1.0F / 12.0F), hn::Mul(fourth, fourth)));
    const V known = madd(depth, depth, madd(linear, linear, hn::Mul(half, even)));
    const V inverse_sigma = hn::Div(one, sigma);
    const V odd = hn::Mul(hn::Mul(half, hn::Sqrt(hn::Max(zero, hn::Sub(square, known)))), inverse_sigma);
    const V rest = hn::IfThenElseZero(kinked, hn::IfThenElse(hn::Lt(margin, zero), odd, hn::Neg(odd)));
    index = WrenchSums::kRest;
    for (std::size_t i = 0; i < 6; ++i) {
      const V scaled = hn::Mul(rest, m[i]);
      for (std::size_t j = i; j < 6; ++j) accumulate(sums_[index++], hn::Mul(scaled, m[j]));
    }
    const V f2 =
        hn::IfThenElseZero(kinked, hn::Mul(hn::Mul(half, hn::Sqrt(even)), hn::Mul(inverse_sigma, inverse_sigma)));
    index = WrenchSums::kKink;
    for (std::size_t i = 0; i < 6; ++i) {
      const V once = hn::Mul(f2, m[i]);
      for (std::size_t j = i; j < 6; ++j) {
        const V twice = hn::Mul(once, m[j]);
        for (std::size_t k = j; k < 6; ++k) accumulate(sums_[index++], hn::Mul(twice, m[k]));
      }
    }
  }

  /// Of the covariance of p.
  HWY_INLINE V trace(const Geometry& g) const {
    const Lanes d;
    V sum = hn::Zero(d);
    for (std::size_t j = 0; j < 6; ++j) {
      const auto error = [&](std::size_t k)
                             HWY_ATTR { return k >= j ? hn::Set(d, s_.factor[k * (k + 1) / 2 + j]) : hn::Zero(d); };
      const V x = hn::Add(error(3), hn::Sub(hn::Mul(error(1), g.pz), hn::Mul(error(2), g.py)));
      const V y = hn::Add(error(4), hn::Sub(hn::Mul(error(2), g.px), hn::Mul(error(0), g.pz)));
      const V z = hn::Add(error(5), hn::Sub(hn::Mul(error(0), g.py), hn::Mul(error(1), g.px)));
      sum = hn::Add(sum, dot3(x, y, z, x, y, z));
    }
    return sum;
  }

  const Swelling& s_;
  float reach_;
  HWY_ALIGN float sums_[WrenchSums::kCount + 1][kPairLanes];
  HWY_ALIGN float local_[LocalSums::kCount][kPairLanes];
  SymmetricTensor bending_;
};

void sum_wrench_lanes(const SphereTree& a, const SphereTree& b, const Swelling& s, float reach, DescentStack* stack,
                      WrenchSums* sums) {
  WrenchSink sink(s, reach);
  descend(a, b, s, stack, sink);
  sink.finish(sums);
}

}  // namespace prescene::collision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace prescene::collision {

HWY_EXPORT(find_critical_lanes);
HWY_EXPORT(intersect_lanes);
HWY_EXPORT(sum_wrench_lanes);

Swelling::Swelling(const RelativeUncertainty& between, const SphereTree& b) : X_AB(between.X_AB()) {
  for (std::size_t i = 0; i < 3; ++i) pivot[i] = static_cast<float>(between.pivot()[static_cast<Eigen::Index>(i)]);
  const double middle = (X_AB * b.root().centre - Vector3f(pivot[0], pivot[1], pivot[2])).cast<double>().norm();
  const auto radius = static_cast<double>(b.root().radius);
  // The root mean square of the nearest and the farthest distance.
  const double nearest = std::max(0.0, middle - radius);
  const double e = std::sqrt(0.5 * (nearest * nearest + (middle + radius) * (middle + radius)));
  const RelativeUncertainty::Growth growth = between.growth();
  // Doubles rounded to floats are off by 6e-8 of themselves, the kernels' sums by a few times that.
  const auto up = [](double x) { return static_cast<float>(x * (1.0 + 1e-6)); };
  // The tangent of sqrt(w) at e^2 is e / 2 + w / (2 e).
  remainder = up(growth.remainder + 0.5 * growth.remainder_slope * e);
  remainder_slope = up(0.5 * growth.remainder_slope / e);
  const double at_e = between.deviation_bound(e);
  const double slope = at_e > 0.0 ? 0.5 * (growth.quadratic + 0.5 * growth.linear / e) / at_e : 0.0;
  deviation = up(at_e - slope * e * e);
  deviation_slope = up(slope);
  region_radius = up(between.region_radius());
  ball_radius = up(between.ball_radius());
  std::size_t index = 0;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j <= i; ++j) factor[index++] = static_cast<float>(between.factor()(i, j));
  }
}

namespace {

/// Each level leaves at most all pairs of children but one behind.
void reserve(const SphereTree& a, const SphereTree& b, DescentStack* stack) {
  const std::size_t levels = static_cast<std::size_t>(a.depth()) + static_cast<std::size_t>(b.depth());
  const std::size_t most = levels * a.branching() * b.branching() + 1;
  if (stack->entries.size() < most) stack->entries.resize(most);
}

}  // namespace

void find_critical_pairs(const SphereTree& a, const SphereTree& b, const Swelling& swelling, DescentStack* stack,
                         CriticalPairs* critical) {
  reserve(a, b, stack);
  HWY_DYNAMIC_DISPATCH(find_critical_lanes)(a, b, swelling, stack, critical);
}

void intersect_lines(const CriticalPairs& critical, const Swelling& swelling, const ErrorLines& lines, bool endless,
                     TouchingIntervals* intervals) {
  HWY_DYNAMIC_DISPATCH(intersect_lanes)(critical, swelling, lines, endless, intervals);
}

void sum_wrenches(const SphereTree& a, const SphereTree& b, const Swelling& swelling, float reach, DescentStack* stack,
                  WrenchSums* sums) {
  reserve(a, b, stack);
  HWY_DYNAMIC_DISPATCH(sum_wrench_lanes)(a, b, swelling, reach, stack, sums);
}

}  // namespace prescene::collision
#endif
