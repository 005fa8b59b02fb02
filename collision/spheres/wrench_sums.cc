// SPDX-License-Identifier: Apache-2.0
#include "uncertain_lanes.h"

#include <algorithm>
#include <array>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "wrench_sums.cc"
#include <hwy/foreach_target.h>
// After foreach_target.h, which includes this file once for each instruction set.
#include <hwy/contrib/math/math-inl.h>
#include <hwy/highway.h>

#include "uncertain_descent-inl.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::collision::HWY_NAMESPACE {

/// Adds up WrenchSums, a vector a number.
class WrenchSink {
 public:
  static constexpr bool kDeepestFirst = false;

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

  HWY_INLINE void add(const PairGeometry& g, hn::Mask<Lanes> there) {
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
    // The descent took the largest deviation in any direction; along n it is often less.
    const auto used = hn::And(there, hn::Lt(margin, hn::Set(d, reach_)));
    if (hn::AllFalse(d, used)) return;
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
  HWY_INLINE V trace(const PairGeometry& g) const {
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

HWY_EXPORT(sum_wrench_lanes);

void sum_wrenches(const SphereTree& a, const SphereTree& b, const Swelling& swelling, float reach, DescentStack* stack,
                  WrenchSums* sums) {
  stack->reserve(a, b);
  HWY_DYNAMIC_DISPATCH(sum_wrench_lanes)(a, b, swelling, reach, stack, sums);
}

}  // namespace prescene::collision
#endif
