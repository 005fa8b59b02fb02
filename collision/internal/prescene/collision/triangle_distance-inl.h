// SPDX-License-Identifier: Apache-2.0
// Distances of up to 16 pairs of triangles at once, for the kernels of this library: include it in a source that is
// compiled for each target by foreach_target.h. The layouts are those of triangle_pairs-inl.h.
//
//   alignas(64) std::array<float, 16> distance;
//   PairVerdict v = distance_of_4_against_4(leaf_a, leaf_b, nearest_so_far, distance.data());
//
// The smallest of the distances of nine pairs of edges and of six corners from the other's face, or zero where the
// triangles certainly intersect. In double precision, and with the points: triangle_pair_distance.h.
//
// Error. With S the largest side of the box about both triangles, a distance that is not zero or infinite is within
// kDistanceError S of the true one. It can't be far below: every candidate is the length of a vector between points of
// the two triangles, whose parameters are clamped or accepted within them, and is off by the rounding of a handful of
// operations on numbers up to S. It is not far above either: parameters come from triple products, so that
// near-parallel edges lose no more than others; a narrow face takes a step of refinement, has its edges near by, and
// where it is close enough for the rest to matter, the intersection test is unsure. The largest error met is 4.0 u (u =
// 2^-24), in 4e6 pairs of needles and near-parallel edges 1e-9 to 1 apart and in the pairs of the tests; the bound is
// 16 u.
//
// Pairs that the intersection test is unsure of get zero, as an edge of one may pass through the middle of the other:
// ask triangle_pair_distance.
#include "prescene/collision/triangle_pairs-inl.h"

#if defined(PRESCENE_COLLISION_TRIANGLE_DISTANCE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef PRESCENE_COLLISION_TRIANGLE_DISTANCE_INL_H_
#undef PRESCENE_COLLISION_TRIANGLE_DISTANCE_INL_H_
#else
#define PRESCENE_COLLISION_TRIANGLE_DISTANCE_INL_H_
#endif

#include <limits>

HWY_BEFORE_NAMESPACE();
namespace prescene::collision::HWY_NAMESPACE {

/// base + factor * direction.
template <class D>
HWY_INLINE Vectors<D> along(D, const Vectors<D>& base, hn::Vec<D> factor, const Vectors<D>& direction) {
  return {hn::MulAdd(factor, direction.x, base.x), hn::MulAdd(factor, direction.y, base.y),
          hn::MulAdd(factor, direction.z, base.z)};
}

/// base - factor * direction.
template <class D>
HWY_INLINE Vectors<D> back_along(D, const Vectors<D>& base, hn::Vec<D> factor, const Vectors<D>& direction) {
  return {hn::NegMulAdd(factor, direction.x, base.x), hn::NegMulAdd(factor, direction.y, base.y),
          hn::NegMulAdd(factor, direction.z, base.z)};
}

template <class D>
HWY_INLINE hn::Vec<D> inverse_or_zero(D d, hn::Vec<D> value) {
  return hn::IfThenElseZero(hn::Gt(value, hn::Zero(d)), hn::Div(hn::Set(d, 1.0F), value));
}

template <class D>
HWY_INLINE hn::Vec<D> clamped(D d, hn::Vec<D> value) {
  return hn::Min(hn::Max(value, hn::Zero(d)), hn::Set(d, 1.0F));
}

/// From the segment from p along u to that from q along v; r = q - p.
template <class D>
HWY_INLINE Vectors<D> edge_to_edge(D d, const Vectors<D>& r, const Vectors<D>& u, hn::Vec<D> inverse_uu,
                                   const Vectors<D>& v, hn::Vec<D> inverse_vv) {
  const Vectors<D> n = cross(d, u, v);
  auto s = clamped(d, hn::Mul(dot(d, cross(d, r, v), n), inverse_or_zero(d, dot(d, n, n))));
  const Vectors<D> from_q = back_along(d, r, s, u);
  const auto t = clamped(d, hn::Neg(hn::Mul(dot(d, from_q, v), inverse_vv)));
  const Vectors<D> to_q = along(d, r, t, v);
  s = clamped(d, hn::Mul(dot(d, to_q, u), inverse_uu));
  return back_along(d, to_q, s, u);
}

/// A face with a corner, the edges u and v from it, and what all points share.
template <class D>
struct Face {
  Vectors<D> u;
  Vectors<D> v;
  Vectors<D> n;
  hn::Vec<D> inverse_nn;
};

template <class D>
HWY_INLINE Face<D> make_face(D d, const Vectors<D>& u, const Vectors<D>& v) {
  const Vectors<D> n = cross(d, u, v);
  return {u, v, n, inverse_or_zero(d, dot(d, n, n))};
}

/// From the face to the point w (from the face's corner), where it is above or below the face.
template <class D>
struct FaceDistance {
  Vectors<D> rest;
  hn::Mask<D> inside;
};

template <class D>
HWY_INLINE FaceDistance<D> face_to_point(D d, const Vectors<D>& w, const Face<D>& face) {
  auto s = hn::Mul(dot(d, cross(d, w, face.v), face.n), face.inverse_nn);
  auto t = hn::Mul(dot(d, cross(d, face.u, w), face.n), face.inverse_nn);
  Vectors<D> rest = back_along(d, back_along(d, w, s, face.u), t, face.v);
  const auto ds = hn::Mul(dot(d, cross(d, rest, face.v), face.n), face.inverse_nn);
  const auto dt = hn::Mul(dot(d, cross(d, face.u, rest), face.n), face.inverse_nn);
  s = hn::Add(s, ds);
  t = hn::Add(t, dt);
  rest = back_along(d, back_along(d, rest, ds, face.u), dt, face.v);
  const auto inside = hn::And(hn::Ge(hn::Min(s, t), hn::Zero(d)),
                              hn::And(hn::Le(hn::Add(s, t), hn::Set(d, 1.0F)), hn::Gt(face.inverse_nn, hn::Zero(d))));
  return {rest, inside};
}

/// The shortest of vectors from a to b, squared, and if wanted itself.
template <class D, bool kBetween>
struct Shortest {
  hn::Vec<D> squared;
  Vectors<D> between;

  HWY_INLINE void keep(D d, const Vectors<D>& v) { keep(d, v, dot(d, v, v)); }
  HWY_INLINE void keep(D d, const Vectors<D>& v, hn::Vec<D> square) {
    if constexpr (kBetween) between = select(d, hn::Lt(square, squared), v, between);
    squared = hn::Min(squared, square);
  }
};

template <class D>
HWY_INLINE Corners<D> scaled(D, const Corners<D>& c, hn::Vec<D> factor) {
  const auto times = [factor](const Vectors<D>& p) HWY_ATTR {
    return Vectors<D>{hn::Mul(p.x, factor), hn::Mul(p.y, factor), hn::Mul(p.z, factor)};
  };
  return {times(c[0]), times(c[1]), times(c[2])};
}

template <bool kBetween, class D>
HWY_INLINE Shortest<D, kBetween> shortest(D d, const Corners<D>& a, const Corners<D>& b) {
  const Corners<D> u = {difference(d, a[1], a[0]), difference(d, a[2], a[1]), difference(d, a[0], a[2])};
  const Corners<D> v = {difference(d, b[1], b[0]), difference(d, b[2], b[1]), difference(d, b[0], b[2])};
  const Face<D> face_a = make_face(d, u[0], difference(d, a[2], a[0]));
  const Face<D> face_b = make_face(d, v[0], difference(d, b[2], b[0]));
  const auto infinity = hn::Set(d, std::numeric_limits<float>::infinity());
  Shortest<D, kBetween> best{infinity, {hn::Zero(d), hn::Zero(d), hn::Zero(d)}};
  const std::array<hn::Vec<D>, 3> inverse_vv = {inverse_or_zero(d, dot(d, v[0], v[0])),
                                                inverse_or_zero(d, dot(d, v[1], v[1])),
                                                inverse_or_zero(d, dot(d, v[2], v[2]))};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto inverse_uu = inverse_or_zero(d, dot(d, u[i], u[i]));
    for (std::size_t k = 0; k < 3; ++k)
      best.keep(d, edge_to_edge(d, difference(d, b[k], a[i]), u[i], inverse_uu, v[k], inverse_vv[k]));
    const FaceDistance<D> to_a = face_to_point(d, difference(d, a[i], b[0]), face_b);
    const Vectors<D> from_a = {hn::Neg(to_a.rest.x), hn::Neg(to_a.rest.y), hn::Neg(to_a.rest.z)};
    best.keep(d, from_a, hn::IfThenElse(to_a.inside, dot(d, from_a, from_a), infinity));
    const FaceDistance<D> to_b = face_to_point(d, difference(d, b[i], a[0]), face_a);
    best.keep(d, to_b.rest, hn::IfThenElse(to_b.inside, dot(d, to_b.rest, to_b.rest), infinity));
  }
  return best;
}

/// What is needed of the box about each triangle: how far they are apart, and the largest side of the box about both.
template <class D>
struct BoxPair {
  hn::Vec<D> gap;  ///< Largest of the gaps along the axes, at least zero; exact up to one rounding.
  hn::Vec<D> extent;
};

template <class D>
HWY_INLINE BoxPair<D> box_pair(D d, const Corners<D>& a, const Corners<D>& b) {
  BoxPair<D> result{hn::Zero(d), hn::Zero(d)};
  const auto axis = [&](auto a0, auto a1, auto a2, auto b0, auto b1, auto b2) HWY_ATTR {
    const auto a_low = hn::Min(hn::Min(a0, a1), a2);
    const auto a_high = hn::Max(hn::Max(a0, a1), a2);
    const auto b_low = hn::Min(hn::Min(b0, b1), b2);
    const auto b_high = hn::Max(hn::Max(b0, b1), b2);
    result.gap = hn::Max(result.gap, hn::Max(hn::Sub(b_low, a_high), hn::Sub(a_low, b_high)));
    result.extent = hn::Max(result.extent, hn::Sub(hn::Max(a_high, b_high), hn::Min(a_low, b_low)));
  };
  axis(a[0].x, a[1].x, a[2].x, b[0].x, b[1].x, b[2].x);
  axis(a[0].y, a[1].y, a[2].y, b[0].y, b[1].y, b[2].y);
  axis(a[0].z, a[1].z, a[2].z, b[0].z, b[1].z, b[2].z);
  return result;
}

template <class D>
struct LaneDistance {
  hn::Vec<D> distance;
  LaneVerdict<D> verdict;
  Vectors<D> between;  ///< From a to b, as long as the distance, where asked for and not zero.
};

// Of the lanes that are near, whatever their distance. Long enough to be worth a call: one copy serves all callers.
template <bool kBetween, class D>
HWY_NOINLINE LaneDistance<D> measure_lanes(D d, const Corners<D>& a, const Corners<D>& b, hn::Vec<D> extent,
                                           hn::Mask<D> near) {
  // 2^e <= extent < 2^(e + 1) becomes 1 to 2. Exponents of denormal extents are all taken as -127.
  const hn::RebindToSigned<D> di;
  const auto exponent = hn::And(hn::BitCast(di, extent), hn::Set(di, 0x7F800000));
  const auto down = hn::BitCast(d, hn::Sub(hn::Set(di, 254 << 23), exponent));
  const auto found = shortest<kBetween>(d, scaled(d, a, down), scaled(d, b, down));
  const auto up = hn::BitCast(d, hn::IfThenElse(hn::Eq(exponent, hn::Zero(di)), hn::Set(di, 1 << 22), exponent));
  const auto distance = hn::Mul(hn::Sqrt(found.squared), up);
  Vectors<D> between = found.between;
  if constexpr (kBetween) between = {hn::Mul(between.x, up), hn::Mul(between.y, up), hn::Mul(between.z, up)};
  const LaneVerdict<D> verdict = test_lanes(d, a, b, near);
  const auto infinity = hn::Set(d, std::numeric_limits<float>::infinity());
  // A pair so small, so far out that its scaled coordinates are not finite.
  const auto lost = hn::Not(hn::Lt(found.squared, infinity));
  const auto unsure = hn::Or(hn::Or(verdict.hit, verdict.unsure), lost);
  return {hn::IfThenElse(near, hn::IfThenZeroElse(unsure, distance), infinity), verdict, between};
}

/// Zero for hits and lanes that the verdict is unsure of, and where the triangles are within 2^-100 of their distance
/// from the origin, which may be too near to be scaled. Lanes that are not active, and those whose boxes are at least
/// `limit` apart along an axis, get infinity. Distances keep their relative precision for triangles of any size: each
/// pair is scaled by a power of two.
template <bool kBetween = false, class D>
HWY_INLINE LaneDistance<D> distance_lanes(D d, const Corners<D>& a, const Corners<D>& b, hn::Vec<D> limit,
                                          hn::Mask<D> active) {
  const BoxPair<D> boxes = box_pair(d, a, b);
  const auto near = hn::And(active, hn::Lt(boxes.gap, limit));
  if (!hn::AllFalse(d, near)) return measure_lanes<kBetween>(d, a, b, boxes.extent, near);
  return {hn::Set(d, std::numeric_limits<float>::infinity()),
          {hn::FirstN(d, 0), hn::FirstN(d, 0)},
          {hn::Zero(d), hn::Zero(d), hn::Zero(d)}};
}

/// Writes the distances of 16 pairs: zero where distance_lanes says zero, infinity for those
/// that are not active or whose distance is `limit` or more (up to a rounding; not all such pairs are found). With
/// kBetween also the vectors from the nearest point of a to that of b, as three rows.
template <bool kBetween = false, class LoadA, class LoadB>
HWY_INLINE PairVerdict distance_of_16(const LoadA& load_a, const LoadB& load_b, float limit, float* distances,
                                      std::uint32_t active, float (*between)[16] = nullptr) {
  const PairTag d;
  PairVerdict verdict;
  for (std::size_t first = 0; first < 16; first += hn::Lanes(d)) {
    const LaneDistance<PairTag> lanes = distance_lanes<kBetween>(d, load_a(d, first), load_b(d, first),
                                                                 hn::Set(d, limit), mask_of_bits(d, active >> first));
    hn::StoreU(lanes.distance, d, distances + first);
    if constexpr (kBetween) {
      hn::StoreU(lanes.between.x, d, between[0] + first);
      hn::StoreU(lanes.between.y, d, between[1] + first);
      hn::StoreU(lanes.between.z, d, between[2] + first);
    }
    verdict.hit |= bits_of_mask(d, lanes.verdict.hit) << first;
    verdict.unsure |= bits_of_mask(d, lanes.verdict.unsure) << first;
  }
  return verdict;
}

/// Pair 4 i + k: triangle i of a and triangle k of b, both float[9][4].
HWY_INLINE PairVerdict distance_of_4_against_4(const float* a, const float* b, float limit, float* distances,
                                               std::uint32_t active = 0xFFFF) {
  return distance_of_16(EachOfFour{a}, AllOfFour{b}, limit, distances, active);
}

}  // namespace prescene::collision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per target
