// SPDX-License-Identifier: Apache-2.0
// Intersection tests of up to 16 pairs of triangles at once, for the kernels of this library: include it in a source
// that is compiled for each target by foreach_target.h.
//
//   PairVerdict each = test_16(SixteenOf{a}, SixteenOf{b}, active);  // 16 arbitrary pairs: a and b are float[9][16]
//   PairVerdict four = test_4_against_4(leaf_a, leaf_b);             // two leaves, float[9][4] each: 4 i + k is (i, k)
//   LaneVerdict<PairTag> lanes = test_lanes(d, corners_a, corners_b, mask);                 // vectors at hand
//
// An answer is never wrong: a pair whose determinants are not clear of rounding is "unsure". With the corners of one
// triangle on both sides of the other's plane and vice versa, both meet the line of the two planes in an interval;
// after the corner that is alone on its side has been put first, two determinants of edges tell whether the intervals
// overlap [Guigue and Devillers 2003].
//
// Error bound. Every determinant is (u x v) . w of three differences of corners. With u the unit roundoff 2^-24, a
// difference is exact up to a factor 1 + u, even when it is denormal. A term u_i v_j w_k takes part in at most 8
// roundings: three differences, two products, the subtraction in the cross product and two additions in the dot product
// (fused operations only leave some out). So the error is at most 8 u / (1 - 8 u) times the sum of the sizes of the six
// terms, which is at most 6 |u| |v| |w| in maximum norms: 48 u |u| |v| |w|. The norms are computed with a factor of at
// least (1 - u)^3 and multiplied with three more roundings; 49 u in place of 48 u is room for more than 300 roundings.
// A product that underflows is off by at most 2^-150: the cross product by 2^-149 in each component, which counts |w|
// times, three times, and the dot product by 3 2^-150, and the bound itself by as much; kUnderflowError (|w| + 1) is
// far above that.
#if defined(PRESCENE_COLLISION_TRIANGLE_PAIRS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef PRESCENE_COLLISION_TRIANGLE_PAIRS_INL_H_
#undef PRESCENE_COLLISION_TRIANGLE_PAIRS_INL_H_
#else
#define PRESCENE_COLLISION_TRIANGLE_PAIRS_INL_H_
#endif

#include <hwy/highway.h>

#include <array>
#include <cstddef>
#include <cstdint>

#include "prescene/collision/lanes-inl.h"
#include "prescene/collision/transform.h"
#include "prescene/collision/triangle_pairs.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::collision::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using PairTag = HWY_CAPPED(float, 16);

template <class D>
struct Vectors {
  hn::Vec<D> x;
  hn::Vec<D> y;
  hn::Vec<D> z;
};

/// Three corners of a triangle in each lane.
template <class D>
using Corners = std::array<Vectors<D>, 3>;

template <class D>
struct LaneVerdict {
  hn::Mask<D> hit;
  hn::Mask<D> unsure;
};

template <class D>
HWY_INLINE Vectors<D> difference(D, const Vectors<D>& to, const Vectors<D>& from) {
  return {hn::Sub(to.x, from.x), hn::Sub(to.y, from.y), hn::Sub(to.z, from.z)};
}

template <class D>
HWY_INLINE Vectors<D> cross(D, const Vectors<D>& u, const Vectors<D>& v) {
  return {hn::MulSub(u.y, v.z, hn::Mul(u.z, v.y)), hn::MulSub(u.z, v.x, hn::Mul(u.x, v.z)),
          hn::MulSub(u.x, v.y, hn::Mul(u.y, v.x))};
}

template <class D>
HWY_INLINE hn::Vec<D> dot(D, const Vectors<D>& u, const Vectors<D>& v) {
  return hn::MulAdd(u.z, v.z, hn::MulAdd(u.y, v.y, hn::Mul(u.x, v.x)));
}

template <class D>
HWY_INLINE hn::Vec<D> largest(D, const Vectors<D>& u) {
  return hn::Max(hn::Max(hn::Abs(u.x), hn::Abs(u.y)), hn::Abs(u.z));
}

template <class D>
HWY_INLINE Vectors<D> select(D, hn::Mask<D> mask, const Vectors<D>& yes, const Vectors<D>& no) {
  return {hn::IfThenElse(mask, yes.x, no.x), hn::IfThenElse(mask, yes.y, no.y), hn::IfThenElse(mask, yes.z, no.z)};
}

/// How far the determinant of three differences may be off, from |u| |v| and |w| in maximum norms.
template <class D>
HWY_INLINE hn::Vec<D> determinant_error(D d, hn::Vec<D> uv, hn::Vec<D> w) {
  const auto underflow = hn::Set(d, kUnderflowError);
  return hn::MulAdd(hn::MulAdd(hn::Set(d, kDeterminantError), uv, underflow), w, underflow);
}

/// Signed volumes of the corners over the plane of a triangle, and what they may be off.
template <class D>
struct Heights {
  std::array<hn::Vec<D>, 3> value;
  hn::Vec<D> error;
  hn::Mask<D> apart;  ///< Certainly all on one side.
};

template <class D>
HWY_INLINE Heights<D> heights(D d, const Corners<D>& plane, const Corners<D>& points) {
  const Vectors<D> u = difference(d, plane[1], plane[0]);
  const Vectors<D> v = difference(d, plane[2], plane[0]);
  const Vectors<D> normal = cross(d, u, v);
  const Vectors<D> w0 = difference(d, points[0], plane[0]);
  const Vectors<D> w1 = difference(d, points[1], plane[0]);
  const Vectors<D> w2 = difference(d, points[2], plane[0]);
  const auto reach = hn::Max(hn::Max(largest(d, w0), largest(d, w1)), largest(d, w2));
  Heights<D> h{{dot(d, normal, w0), dot(d, normal, w1), dot(d, normal, w2)},
               determinant_error(d, hn::Mul(largest(d, u), largest(d, v)), reach),
               {}};
  const auto low = hn::Min(hn::Min(h.value[0], h.value[1]), h.value[2]);
  const auto high = hn::Max(hn::Max(h.value[0], h.value[1]), h.value[2]);
  h.apart = hn::Or(hn::Gt(low, h.error), hn::Lt(high, hn::Neg(h.error)));
  return h;
}

template <class D>
HWY_INLINE hn::Mask<D> boxes_overlap(D, const Corners<D>& a, const Corners<D>& b) {
  const auto axis = [](auto a0, auto a1, auto a2, auto b0, auto b1, auto b2) HWY_ATTR {
    return hn::And(hn::Le(hn::Min(hn::Min(a0, a1), a2), hn::Max(hn::Max(b0, b1), b2)),
                   hn::Le(hn::Min(hn::Min(b0, b1), b2), hn::Max(hn::Max(a0, a1), a2)));
  };
  return hn::And(hn::And(axis(a[0].x, a[1].x, a[2].x, b[0].x, b[1].x, b[2].x),
                         axis(a[0].y, a[1].y, a[2].y, b[0].y, b[1].y, b[2].y)),
                 axis(a[0].z, a[1].z, a[2].z, b[0].z, b[1].z, b[2].z));
}

/// The corners turned so that the one alone on its side of the other's plane comes first, and whether its side is the
/// positive one. Means nothing where a height is not sure.
template <class D>
struct Turned {
  Corners<D> corners;
  hn::Mask<D> up;
  hn::Mask<D> sure;
};

template <class D>
HWY_INLINE Turned<D> turn(D d, const Corners<D>& c, const Heights<D>& h) {
  const auto zero = hn::Zero(d);
  const auto up0 = hn::Gt(h.value[0], zero);
  const auto up1 = hn::Gt(h.value[1], zero);
  const auto up2 = hn::Gt(h.value[2], zero);
  const auto last = hn::Not(hn::Xor(up0, up1));
  const auto middle = hn::AndNot(last, hn::Not(hn::Xor(up0, up2)));
  const auto pick = [&](const Vectors<D>& if_first, const Vectors<D>& if_middle, const Vectors<D>& if_last)
                        HWY_ATTR { return select(d, last, if_last, select(d, middle, if_middle, if_first)); };
  const auto nearest = hn::Min(hn::Min(hn::Abs(h.value[0]), hn::Abs(h.value[1])), hn::Abs(h.value[2]));
  // The one that is alone is up when the two others, which agree, are not.
  const auto up = hn::Or(hn::And(last, up2), hn::AndNot(last, hn::Or(hn::And(middle, up1), hn::AndNot(middle, up0))));
  return {{pick(c[0], c[1], c[2]), pick(c[1], c[2], c[0]), pick(c[2], c[0], c[1])}, up, hn::Gt(nearest, h.error)};
}

/// The pairs of lanes for which `active` is set; the other lanes get no bits.
template <class D>
HWY_INLINE LaneVerdict<D> test_lanes(D d, const Corners<D>& a, const Corners<D>& b, hn::Mask<D> active) {
  const auto none = hn::FirstN(d, 0);
  const Heights<D> over_b = heights(d, b, a);
  auto live = hn::AndNot(over_b.apart, active);
  if (hn::AllFalse(d, live)) return {none, none};
  const Heights<D> over_a = heights(d, a, b);
  live = hn::AndNot(over_a.apart, live);
  if (hn::AllFalse(d, live)) return {none, none};
  live = hn::And(live, boxes_overlap(d, a, b));
  if (hn::AllFalse(d, live)) return {none, none};

  const Turned<D> p = turn(d, a, over_b);
  const Turned<D> q = turn(d, b, over_a);
  const auto sure = hn::And(p.sure, q.sure);
  // With both first corners up, the edges from p0 to p1 and from q0 to q2 end the intervals forwards. A first corner
  // that is down is turned up by exchanging the other triangle's last two; exchanging those of both changes the sign.
  const auto exchange = hn::Xor(p.up, q.up);
  const Vectors<D> q1 = select(d, exchange, q.corners[2], q.corners[1]);
  const Vectors<D> q2 = select(d, exchange, q.corners[1], q.corners[2]);
  const Vectors<D> u1 = difference(d, p.corners[1], p.corners[0]);
  const Vectors<D> u2 = difference(d, p.corners[2], p.corners[0]);
  const Vectors<D> v1 = difference(d, q1, q.corners[0]);
  const Vectors<D> v2 = difference(d, q2, q.corners[0]);
  const Vectors<D> w =
      difference(d, select(d, q.up, q.corners[0], p.corners[0]), select(d, q.up, p.corners[0], q.corners[0]));
  const auto first = dot(d, cross(d, u1, v1), w);
  const auto second = hn::Neg(dot(d, cross(d, u2, v2), w));
  const auto error = determinant_error(
      d, hn::Mul(hn::Max(largest(d, u1), largest(d, u2)), hn::Max(largest(d, v1), largest(d, v2))), largest(d, w));
  const auto smaller = hn::Min(first, second);
  const auto hit = hn::And(hn::And(live, sure), hn::Gt(smaller, error));
  const auto miss = hn::And(sure, hn::Lt(smaller, hn::Neg(error)));
  return {hit, hn::AndNot(miss, hn::AndNot(hit, live))};
}

/// `row` gives coordinate number r, 0 to 8.
template <class D, class Row>
HWY_INLINE Corners<D> corners_of_rows(D, const Row& row) {
  return {Vectors<D>{row(0), row(1), row(2)}, Vectors<D>{row(3), row(4), row(5)}, Vectors<D>{row(6), row(7), row(8)}};
}

/// Corners of the triangles `first` and on, whose coordinates are rows of `stride` floats.
template <class D>
HWY_INLINE Corners<D> load_corners(D d, const float* rows, std::size_t stride, std::size_t first) {
  return corners_of_rows(d, [&](std::size_t r) HWY_ATTR { return hn::LoadU(d, rows + r * stride + first); });
}

/// The same triangle in each lane; coordinates `stride` floats apart.
template <class D>
HWY_INLINE Corners<D> broadcast_corners(D d, const float* coordinates, std::size_t stride) {
  return corners_of_rows(d, [&](std::size_t r) HWY_ATTR { return hn::Set(d, coordinates[r * stride]); });
}

/// X_AB * p_BQ, rounded as in transform.h: no fused operations.
template <class D>
HWY_INLINE Corners<D> placed(D d, const Transform& X_AB, const Corners<D>& corners_B) {
  const auto place = [&](const Vectors<D>& p) HWY_ATTR {
    const auto axis = [&](std::size_t i) HWY_ATTR {
      const auto& r = X_AB.rotation;
      const auto xy = hn::Add(hn::Mul(hn::Set(d, r[3 * i]), p.x), hn::Mul(hn::Set(d, r[3 * i + 1]), p.y));
      return hn::Add(hn::Add(xy, hn::Mul(hn::Set(d, r[3 * i + 2]), p.z)), hn::Set(d, X_AB.translation[i]));
    };
    return Vectors<D>{axis(0), axis(1), axis(2)};
  };
  return {place(corners_B[0]), place(corners_B[1]), place(corners_B[2])};
}

// Where the triangles of pairs come from: each loads those of the pairs `first` and on.

/// Triangle i of float[9][16] for pair i.
struct SixteenOf {
  const float* rows;
  HWY_INLINE Corners<PairTag> operator()(PairTag d, std::size_t first) const {
    return load_corners(d, rows, 16, first);
  }
};

/// Triangle i / 4 of float[9][4] for pair i.
struct EachOfFour {
  const float* rows;
  HWY_INLINE Corners<PairTag> operator()(PairTag d, std::size_t first) const {
#if HWY_TARGET == HWY_SCALAR
    return broadcast_corners(d, rows + first / 4, 4);
#else
    const auto lanes = hn::Iota(hn::RebindToSigned<PairTag>(), static_cast<std::int32_t>(first));
    const auto indices = hn::IndicesFromVec(d, hn::ShiftRight<2>(lanes));
    return corners_of_rows(
        d, [&](std::size_t r) HWY_ATTR { return hn::TableLookupLanes(hn::LoadDup128(d, rows + 4 * r), indices); });
#endif
  }
};

/// Triangle i modulo 4 of float[9][4] for pair i.
struct AllOfFour {
  const float* rows;
  HWY_INLINE Corners<PairTag> operator()(PairTag d, std::size_t first) const {
#if HWY_TARGET == HWY_SCALAR
    return broadcast_corners(d, rows + first % 4, 4);
#else
    static_cast<void>(first);
    return corners_of_rows(d, [&](std::size_t r) HWY_ATTR { return hn::LoadDup128(d, rows + 4 * r); });
#endif
  }
};

template <class LoadA, class LoadB>
HWY_INLINE PairVerdict test_16(const LoadA& load_a, const LoadB& load_b, std::uint32_t active) {
  const PairTag d;
  PairVerdict verdict;
  for (std::size_t first = 0; first < 16; first += hn::Lanes(d)) {
    const auto wanted = mask_of_bits(d, active >> first);
    if (hn::AllFalse(d, wanted)) continue;
    const LaneVerdict<PairTag> lanes = test_lanes(d, load_a(d, first), load_b(d, first), wanted);
    verdict.hit |= bits_of_mask(d, lanes.hit) << first;
    verdict.unsure |= bits_of_mask(d, lanes.unsure) << first;
  }
  return verdict;
}

/// Pair 4 i + k: triangle i of a and triangle k of b, both float[9][4].
HWY_INLINE PairVerdict test_4_against_4(const float* a, const float* b, std::uint32_t active = 0xFFFF) {
  return test_16(EachOfFour{a}, AllOfFour{b}, active);
}

}  // namespace prescene::collision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per target
