// SPDX-License-Identifier: Apache-2.0
#include "uncertain_lanes.h"

#include <algorithm>
#include <array>
#include <utility>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "wrench_sums.cc"
#include <hwy/foreach_target.h>
// After foreach_target.h, which includes this file once for each instruction set.
#include <hwy/contrib/math/math-inl.h>
#include <hwy/highway.h>

#include "uncertain_descent-inl.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::collision::HWY_NAMESPACE {

/// Indices i <= j (<= k) of the entries of a symmetric matrix and tensor over m, in order.
struct Entry {
  std::size_t i, j, k;
};
constexpr std::array<Entry, 21> matrix_entries() {
  std::array<Entry, 21> entries{};
  std::size_t at = 0;
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = i; j < 6; ++j) entries[at++] = {i, j, 0};
  }
  return entries;
}
template <std::size_t N, std::size_t Count>
constexpr std::array<Entry, Count> tensor_entries() {
  std::array<Entry, Count> entries{};
  std::size_t at = 0;
  for (std::size_t i = 0; i < N; ++i) {
    for (std::size_t j = i; j < N; ++j) {
      for (std::size_t k = j; k < N; ++k) entries[at++] = {i, j, k};
    }
  }
  return entries;
}
inline constexpr std::array<Entry, 21> kMatrix = matrix_entries();
inline constexpr std::array<Entry, 10> kCubic = tensor_entries<3, 10>();
inline constexpr std::array<Entry, 56> kTensor = tensor_entries<6, 56>();

/// Adds up WrenchSums, a vector a number: first what is summed over a buffer of pairs, then the sums, few enough at a
/// time for the registers.
class WrenchSink {
 public:
  static constexpr bool kDeepestFirst = false;

  WrenchSink(const Swelling& s, float reach) : s_(s), reach_(reach) {}

  Growth growth(bool) const { return growth_by(s_, reach_); }
  bool ended() const { return false; }
  std::size_t enough() const { return PairBuffer::kCapacity - 256; }

  void flush(PairBuffer* buffer) {
    if (buffer->size == 0) return;
    if (!begun_) begin();
    const Lanes d;
    kinks_ = 0;
    for (std::size_t i = 0; i < buffer->size; i += hn::Lanes(d))
      look_at(geometry_of(*buffer, s_, i), hn::FirstN(d, buffer->size - i), i);
    sum_forces(buffer->size);
    sum_sideways(*buffer);
    sum_bending(*buffer);
    sum_kinks();
    buffer->size = 0;
  }

  /// Leaves `result` as it is, which has no pairs, where none were found.
  void finish(WrenchSums* result) const {
    if (!begun_) return;
    for (std::size_t i = 0; i < WrenchSums::kCount; ++i) result->sums[i] = total(sums_[i]);
    result->pairs = touching_;
    result->bending = bending_;
  }

 private:
  using Number = float[PairBuffer::kCapacity + kPairLanes];

  /// Clearing the sums would cost bodies that are apart most of their time.
  void begin() {
    for (auto& lanes : sums_) std::fill(std::begin(lanes), std::end(lanes), 0.0F);
    for (geometry::Matrix6d& m : bending_) m.setZero();
    begun_ = true;
  }

  static double total(const float* lanes) {
    double sum = 0.0;
    for (std::size_t k = 0; k < kPairLanes; ++k) sum += static_cast<double>(lanes[k]);
    return sum;
  }

  HWY_INLINE void look_at(const PairGeometry& g, hn::Mask<Lanes> there, std::size_t at) {
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
    const V inverse_sigma = hn::Div(one, sigma);
    const V margin = hn::Max(hn::Min(hn::Mul(gap, inverse_sigma), hn::Set(d, 12.0F)), hn::Set(d, -12.0F));
    // The descent took the largest deviation in any direction; along n it is often less.
    const auto used = hn::And(there, hn::Lt(margin, hn::Set(d, reach_)));
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
    const V normal = hn::Add(f1, w);
    const V m[6] = {g.cx, g.cy, g.cz, g.nx, g.ny, g.nz};
    for (std::size_t k = 0; k < 6; ++k) hn::StoreU(m[k], d, m_[k] + at);
    hn::StoreU(f0, d, f0_ + at);
    hn::StoreU(f1, d, f1_ + at);
    hn::StoreU(w, d, w_ + at);
    hn::StoreU(normal, d, normal_ + at);
    hn::StoreU(hn::Neg(hn::Mul(normal, inverse)), d, bend_ + at);

    // Pairs that surely touch or surely don't have no kink.
    const auto kinked = hn::And(used, hn::Gt(margin, hn::Set(d, -reach_)));
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
    const V odd = hn::Mul(hn::Mul(half, hn::Sqrt(hn::Max(zero, hn::Sub(square, known)))), inverse_sigma);
    const V rest = hn::IfThenElse(hn::Lt(margin, zero), odd, hn::Neg(odd));
    const V f2 = hn::Mul(hn::Mul(half, hn::Sqrt(even)), hn::Mul(inverse_sigma, inverse_sigma));
    for (std::size_t k = 0; k < 6; ++k) hn::StoreU(hn::Compress(m[k], kinked), d, kink_m_[k] + kinks_);
    hn::StoreU(hn::Compress(rest, kinked), d, rest_ + kinks_);
    hn::StoreU(hn::Compress(f2, kinked), d, f2_ + kinks_);
    kinks_ += hn::CountTrue(d, kinked);
  }

  /// Adds term(i, 0...Count - 1) for the vectors at i to sums; `term` is called with constants.
  template <std::size_t... I, class Term>
  HWY_INLINE static void add(std::index_sequence<I...>, std::size_t size, float (*sums)[kPairLanes], const Term& term) {
    const Lanes d;
    V sum[] = {hn::Load(d, sums[I])...};
    for (std::size_t i = 0; i < size; i += hn::Lanes(d)) term(i, sum);
    (hn::Store(sum[I], d, sums[I]), ...);
  }

  HWY_INLINE static V at(const Number& numbers, std::size_t i) { return hn::LoadU(Lanes(), numbers + i); }

  template <std::size_t... I>
  HWY_INLINE static void add_matrix(std::index_sequence<I...>, V weight, const V* m, V* sum) {
    ((sum[I] = hn::MulAdd(hn::Mul(weight, m[kMatrix[I].i]), m[kMatrix[I].j], sum[I])), ...);
  }
  template <std::size_t First, std::size_t... I>
  HWY_INLINE static void add_tensor(std::index_sequence<I...>, V weight, const V* m, V* sum) {
    ((sum[I] = hn::MulAdd(hn::Mul(hn::Mul(weight, m[kTensor[First + I].i]), m[kTensor[First + I].j]),
                          m[kTensor[First + I].k], sum[I])),
     ...);
  }
  template <std::size_t... I>
  HWY_INLINE static void add_cubic(std::index_sequence<I...>, V weight, const V* n, V* sum) {
    ((sum[I] = hn::MulAdd(hn::Mul(hn::Mul(weight, n[kCubic[I].i]), n[kCubic[I].j]), n[kCubic[I].k], sum[I])), ...);
  }

  HWY_INLINE void sum_forces(std::size_t size) {
    add(std::make_index_sequence<27>(), size, sums_ + WrenchSums::kMean, [&](std::size_t i, V* sum) HWY_ATTR {
      const V m[6] = {at(m_[0], i), at(m_[1], i), at(m_[2], i), at(m_[3], i), at(m_[4], i), at(m_[5], i)};
      const V f0 = at(f0_, i);
      sum[0] = hn::MulAdd(f0, m[3], sum[0]);
      sum[1] = hn::MulAdd(f0, m[4], sum[1]);
      sum[2] = hn::MulAdd(f0, m[5], sum[2]);
      sum[3] = hn::MulAdd(f0, m[0], sum[3]);
      sum[4] = hn::MulAdd(f0, m[1], sum[4]);
      sum[5] = hn::MulAdd(f0, m[2], sum[5]);
      add_matrix(std::make_index_sequence<21>(), at(normal_, i), m, sum + (WrenchSums::kNormal - WrenchSums::kMean));
    });
  }

  HWY_INLINE void sum_sideways(const PairBuffer& buffer) {
    add(std::make_index_sequence<16>(), buffer.size, sums_ + WrenchSums::kSideways,
        [&](std::size_t i, V* sum) HWY_ATTR {
          const Lanes d;
          const V w = at(w_, i);
          sum[0] = hn::Add(sum[0], w);
          const V p[3] = {hn::LoadU(d, buffer.b[0].data() + i), hn::LoadU(d, buffer.b[1].data() + i),
                          hn::LoadU(d, buffer.b[2].data() + i)};
          const V a[3] = {hn::LoadU(d, buffer.a[0].data() + i), hn::LoadU(d, buffer.a[1].data() + i),
                          hn::LoadU(d, buffer.a[2].data() + i)};
          for (std::size_t k = 0; k < 3; ++k) {
            sum[1 + k] = hn::MulAdd(w, p[k], sum[1 + k]);
            const V scaled = hn::Mul(w, a[k]);
            sum[4 + k] = hn::Add(sum[4 + k], scaled);
            for (std::size_t j = 0; j < 3; ++j) sum[7 + 3 * k + j] = hn::MulAdd(scaled, p[j], sum[7 + 3 * k + j]);
          }
        });
  }

  HWY_INLINE void sum_bending(const PairBuffer& buffer) {
    HWY_ALIGN float lanes[LocalSums::kCount][kPairLanes];
    for (auto& of_one : lanes) std::fill(std::begin(of_one), std::end(of_one), 0.0F);
    add(std::make_index_sequence<LocalSums::kCount>(), buffer.size, lanes, [&](std::size_t i, V* sum) HWY_ATTR {
      const Lanes d;
      const V f1 = at(f1_, i);
      const V b = at(bend_, i);
      const V n[3] = {at(m_[3], i), at(m_[4], i), at(m_[5], i)};
      sum[LocalSums::kWeight] = hn::Add(sum[LocalSums::kWeight], f1);
      for (std::size_t k = 0; k < 3; ++k) {
        V& place = sum[LocalSums::kPlace + k];
        place = hn::MulAdd(f1, hn::LoadU(d, buffer.b[k].data() + i), place);
        V& bent = sum[LocalSums::kBent + k];
        bent = hn::MulAdd(b, n[k], bent);
      }
      add_cubic(std::make_index_sequence<10>(), b, n, sum + LocalSums::kCubic);
    });
    LocalSums local;
    for (std::size_t i = 0; i < LocalSums::kCount; ++i) local.sums[i] = total(lanes[i]);
    touching_ += 2.0 * local.sums[LocalSums::kWeight];
    add_bending(local, &bending_);
  }

  HWY_INLINE void sum_kinks() {
    if (kinks_ == 0) return;
    const Lanes d;
    hn::StoreU(hn::Zero(d), d, rest_ + kinks_);
    hn::StoreU(hn::Zero(d), d, f2_ + kinks_);
    for (Number& numbers : kink_m_) hn::StoreU(hn::Zero(d), d, numbers + kinks_);
    const auto all_m = [&](std::size_t i, V* m) HWY_ATTR {
      for (std::size_t k = 0; k < 6; ++k) m[k] = at(kink_m_[k], i);
    };
    add(std::make_index_sequence<21>(), kinks_, sums_ + WrenchSums::kRest, [&](std::size_t i, V* sum) HWY_ATTR {
      V m[6];
      all_m(i, m);
      add_matrix(std::make_index_sequence<21>(), at(rest_, i), m, sum);
    });
    add(std::make_index_sequence<21>(), kinks_, sums_ + WrenchSums::kKink, [&](std::size_t i, V* sum) HWY_ATTR {
      V m[6];
      all_m(i, m);
      add_tensor<0>(std::make_index_sequence<21>(), at(f2_, i), m, sum);
    });
    add(std::make_index_sequence<15>(), kinks_, sums_ + WrenchSums::kKink + 21, [&](std::size_t i, V* sum) HWY_ATTR {
      V m[6];
      all_m(i, m);
      add_tensor<21>(std::make_index_sequence<15>(), at(f2_, i), m, sum);
    });
    add(std::make_index_sequence<20>(), kinks_, sums_ + WrenchSums::kKink + 36, [&](std::size_t i, V* sum) HWY_ATTR {
      V m[6];
      all_m(i, m);
      add_tensor<36>(std::make_index_sequence<20>(), at(f2_, i), m, sum);
    });
  }

  /// Of the covariance of p: it is least at the pivot, and quadratic.
  HWY_INLINE V trace(const PairGeometry& g) const {
    const Lanes d;
    const V x = hn::Sub(g.px, hn::Set(d, s_.pivot[0]));
    const V y = hn::Sub(g.py, hn::Set(d, s_.pivot[1]));
    const V z = hn::Sub(g.pz, hn::Set(d, s_.pivot[2]));
    const auto row = [&](std::size_t k) HWY_ATTR {
      return dot3(hn::Set(d, s_.trace_growth[3 * k]), hn::Set(d, s_.trace_growth[3 * k + 1]),
                  hn::Set(d, s_.trace_growth[3 * k + 2]), x, y, z);
    };
    return hn::Add(dot3(row(0), row(1), row(2), x, y, z), hn::Set(d, s_.least_trace));
  }

  const Swelling& s_;
  float reach_;
  bool begun_ = false;
  HWY_ALIGN float sums_[WrenchSums::kCount][kPairLanes];
  double touching_ = 0.0;
  SymmetricTensor bending_;
  // Of the pairs of a buffer, and of those with a kink.
  HWY_ALIGN Number m_[6];
  HWY_ALIGN Number f0_;
  HWY_ALIGN Number f1_;
  HWY_ALIGN Number w_;
  HWY_ALIGN Number normal_;
  HWY_ALIGN Number bend_;
  std::size_t kinks_ = 0;
  HWY_ALIGN Number kink_m_[6];
  HWY_ALIGN Number rest_;
  HWY_ALIGN Number f2_;
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
  HWY_DYNAMIC_DISPATCH(sum_wrench_lanes)(a, b, swelling, reach, stack, sums);
}

}  // namespace prescene::collision
#endif
