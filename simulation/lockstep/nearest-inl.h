// SPDX-License-Identifier: Apache-2.0
// Nearest points of two convex cores in lanes: GJK [Gilbert, Johnson & Keerthi 1988] in which every new point is joined
// with each side of the last triangle, so that all lanes take the same way through it.
#if defined(PRESCENE_SIMULATION_NEAREST_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef PRESCENE_SIMULATION_NEAREST_INL_H_
#undef PRESCENE_SIMULATION_NEAREST_INL_H_
#else
#define PRESCENE_SIMULATION_NEAREST_INL_H_
#endif

#include "lane_math-inl.h"
#include "lane_state.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::simulation::HWY_NAMESPACE {

/// The farthest point of a core in a direction; both in S, from the part's middle.
template <class V>
HWY_INLINE Vec3<V> support_of(const ConvexPart& part, const Vec3<V>& direction) {
  const V zero = set<V>(0.0);
  switch (part.kind) {
    case CoreKind::kPoint:
    case CoreKind::kSpheres:  // no core
      break;
    case CoreKind::kSegment: {
      const V z = set<V>(part.half[2]);
      return {zero, zero, select(hn::Ge(direction.z, zero), z, hn::Neg(z))};
    }
    case CoreKind::kBox: {
      const Vec3<V> half = set3<V>(part.half);
      return {select(hn::Ge(direction.x, zero), half.x, hn::Neg(half.x)),
              select(hn::Ge(direction.y, zero), half.y, hn::Neg(half.y)),
              select(hn::Ge(direction.z, zero), half.z, hn::Neg(half.z))};
    }
    case CoreKind::kCylinder: {
      const V s = hn::Sqrt(direction.x * direction.x + direction.y * direction.y);
      const auto slanted = hn::Gt(s, zero);
      const V scale = set<V>(part.half[0]) / select(slanted, s, set<V>(1.0));
      const V z = set<V>(part.half[2]);
      return {select(slanted, direction.x * scale, set<V>(part.half[0])), direction.y * scale,
              select(hn::Ge(direction.z, zero), z, hn::Neg(z))};
    }
    case CoreKind::kCone: {
      const V s = hn::Sqrt(direction.x * direction.x + direction.y * direction.y);
      const V r = set<V>(part.half[0]);
      const V tip = set<V>(part.half[1]);
      const V base = set<V>(part.half[2]);
      const auto at_tip = hn::Gt(direction.z * tip, s * r + direction.z * base);
      const auto slanted = hn::Gt(s, zero);
      const V scale = r / select(slanted, s, set<V>(1.0));
      return {hn::IfThenElseZero(hn::Not(at_tip), select(slanted, direction.x * scale, r)),
              hn::IfThenElseZero(hn::Not(at_tip), direction.y * scale), select(at_tip, tip, base)};
    }
    case CoreKind::kHull: {
      Vec3<V> best = set3<V>(part.vertices[0]);
      V height = dot(best, direction);
      for (std::size_t i = 1; i < part.vertices.size(); ++i) {
        const Vec3<V> vertex = set3<V>(part.vertices[i]);
        const V h = dot(vertex, direction);
        const auto higher = hn::Gt(h, height);
        height = select(higher, h, height);
        best = select(higher, vertex, best);
      }
      return best;
    }
  }
  return {zero, zero, zero};
}

/// From B to A: points on_a - on_b = v.
template <class V>
struct Nearest {
  Vec3<V> v, on_a;
  V squared;
  MOf<V> overlap;  ///< The cores do, or nearly.
  MOf<V> apart;    ///< By more than was asked for.
};

template <class V>
struct Simplex {
  Vec3<V> p[3];  ///< Of A - B.
  Vec3<V> a[3];  ///< Of A.
};

/// A point of the triangle or segment of the new point and two others that is the nearest to the origin so far.
template <class V>
struct Candidate {
  V squared;
  Vec3<V> v;
  V share_1, share_2;  ///< Of the two others.
  V index_1, index_2;  ///< Which; 3 is the new one.
};

template <class V>
HWY_INLINE void keep_nearer(MOf<V> valid, V squared, const Vec3<V>& v, V share_1, V share_2, double index_1,
                            double index_2, Candidate<V>& best) {
  const auto nearer = hn::And(valid, hn::Lt(squared, best.squared));
  best.squared = select(nearer, squared, best.squared);
  best.v = select(nearer, v, best.v);
  best.share_1 = select(nearer, share_1, best.share_1);
  best.share_2 = select(nearer, share_2, best.share_2);
  best.index_1 = select(nearer, set<V>(index_1), best.index_1);
  best.index_2 = select(nearer, set<V>(index_2), best.index_2);
}

template <class V>
HWY_INLINE void try_segment(const Simplex<V>& simplex, const Vec3<V>& p, int i, Candidate<V>& best) {
  const V zero = set<V>(0.0);
  const V one = set<V>(1.0);
  const Vec3<V> e = simplex.p[i] - p;
  const V ee = dot(e, e);
  const auto proper = hn::Gt(ee, zero);
  const V t = hn::IfThenElseZero(proper, hn::Min(hn::Max(hn::Neg(dot(p, e)) / select(proper, ee, one), zero), one));
  const Vec3<V> v = p + e * t;
  keep_nearer(hn::Eq(zero, zero), dot(v, v), v, t, zero, i, 3, best);
}

/// Returns for which lanes the origin lies on the same side of the triangle as `opposite` (strictly).
template <class V>
HWY_INLINE MOf<V> try_triangle(const Simplex<V>& simplex, const Vec3<V>& p, int i, int j, const Vec3<V>& opposite,
                               Candidate<V>& best) {
  constexpr double kFlat = 1e-28;  // m^4: below it a triangle is a line
  const V zero = set<V>(0.0);
  const Vec3<V>& q = simplex.p[i];
  const Vec3<V>& r = simplex.p[j];
  const Vec3<V> n = cross(q - p, r - p);
  const V nn = dot(n, n);
  const auto proper = hn::Gt(nn, set<V>(kFlat));
  const V scale = set<V>(1.0) / select(proper, nn, set<V>(1.0));
  const V height = dot(n, p);
  const V share_p = dot(n, cross(q, r)) * scale;
  const V share_q = dot(n, cross(r, p)) * scale;
  const V share_r = dot(n, cross(p, q)) * scale;
  const auto inside =
      hn::And(proper, hn::And(hn::Gt(share_p, zero), hn::And(hn::Gt(share_q, zero), hn::Gt(share_r, zero))));
  const Vec3<V> v = n * (height * scale);
  keep_nearer(inside, height * height * scale, v, share_q, share_r, i, j, best);
  // The origin is at -height of the plane through p, the opposite corner at n.(opposite - p).
  return hn::Lt(height * dot(n, opposite - p), zero);
}

/// `limit`: what is farther apart is not wanted. `on_b(direction)` and `on_a(direction)` are farthest points.
template <class V, class OnA, class OnB>
HWY_INLINE Nearest<V> nearest_points(const Vec3<V>& guess, V limit, MOf<V> wanted, const OnA& on_a, const OnB& on_b) {
  // Shares of the squared distance: cores of a few centimetres that are two rounding radii apart get their normal to
  // 1e-4 rad where they are round, and to rounding where they are not.
  constexpr double kConverged = 1e-8;
  constexpr double kTouching = 1e-16;  // m^2
  constexpr int kMostIterations = 48;
  using DV = DOf<V>;
  const DV d;
  const V zero = set<V>(0.0);
  const V limit2 = limit * limit;
  Nearest<V> result;
  const auto none = hn::Lt(zero, zero);
  result.overlap = none;
  result.apart = none;
  Simplex<V> simplex;
  simplex.a[0] = on_a(neg(guess));
  simplex.p[0] = simplex.a[0] - on_b(guess);
  for (int i = 1; i < 3; ++i) {
    simplex.a[i] = simplex.a[0];
    simplex.p[i] = simplex.p[0];
  }
  result.v = simplex.p[0];
  result.on_a = simplex.a[0];
  result.squared = dot(result.v, result.v);
  auto active = wanted;
  for (int iteration = 0; iteration < kMostIterations; ++iteration) {
    const auto touching = hn::And(active, hn::Le(result.squared, set<V>(kTouching)));
    result.overlap = hn::Or(result.overlap, touching);
    active = hn::AndNot(touching, active);
    const Vec3<V> a = on_a(neg(result.v));
    const Vec3<V> p = a - on_b(result.v);
    const V along = dot(result.v, p);
    const auto apart = hn::And(active, hn::And(hn::Gt(along, zero), hn::Gt(along * along, result.squared * limit2)));
    result.apart = hn::Or(result.apart, apart);
    const auto converged = hn::Le(result.squared - along, set<V>(kConverged) * result.squared);
    active = hn::AndNot(hn::Or(apart, converged), active);
    if (hn::AllFalse(d, active)) break;

    Candidate<V> best{dot(p, p), p, zero, zero, set<V>(3.0), set<V>(3.0)};
    for (int i = 0; i < 3; ++i) try_segment(simplex, p, i, best);
    auto within = try_triangle(simplex, p, 0, 1, simplex.p[2], best);
    within = hn::And(within, try_triangle(simplex, p, 1, 2, simplex.p[0], best));
    within = hn::And(within, try_triangle(simplex, p, 2, 0, simplex.p[1], best));
    // The last triangle: the origin is on the new point's side.
    const Vec3<V> base = cross(simplex.p[1] - simplex.p[0], simplex.p[2] - simplex.p[0]);
    within = hn::And(within, hn::Lt(dot(base, simplex.p[0]) * dot(base, p - simplex.p[0]), zero));
    within = hn::And(within, active);
    result.overlap = hn::Or(result.overlap, within);
    active = hn::AndNot(within, active);
    active = hn::And(active, hn::Lt(best.squared, result.squared));

    const auto pick = [&](V index, const Vec3<V>(&old)[3], const Vec3<V>& added) HWY_ATTR {
      Vec3<V> chosen = select(hn::Eq(index, zero), old[0], added);
      chosen = select(hn::Eq(index, set<V>(1.0)), old[1], chosen);
      return select(hn::Eq(index, set<V>(2.0)), old[2], chosen);
    };
    const Vec3<V> p1 = pick(best.index_1, simplex.p, p);
    const Vec3<V> p2 = pick(best.index_2, simplex.p, p);
    const Vec3<V> a1 = pick(best.index_1, simplex.a, a);
    const Vec3<V> a2 = pick(best.index_2, simplex.a, a);
    simplex.p[0] = select(active, p, simplex.p[0]);
    simplex.p[1] = select(active, p1, simplex.p[1]);
    simplex.p[2] = select(active, p2, simplex.p[2]);
    simplex.a[0] = select(active, a, simplex.a[0]);
    simplex.a[1] = select(active, a1, simplex.a[1]);
    simplex.a[2] = select(active, a2, simplex.a[2]);
    const V share_0 = set<V>(1.0) - best.share_1 - best.share_2;
    result.v = select(active, best.v, result.v);
    result.on_a = select(active, a * share_0 + a1 * best.share_1 + a2 * best.share_2, result.on_a);
    result.squared = select(active, best.squared, result.squared);
  }
  return result;
}

}  // namespace prescene::simulation::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
