// SPDX-License-Identifier: Apache-2.0
// Two bodies of spheres, first part: which spheres of the one are near which patches of the other, by descending both
// trees. Of two surfaces one's spheres are met with the other's patches; many patches reach under a sphere, and the one
// whose point is nearest knows best.
#if defined(PRESCENE_SIMULATION_SPHERE_DESCENT_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef PRESCENE_SIMULATION_SPHERE_DESCENT_INL_H_
#undef PRESCENE_SIMULATION_SPHERE_DESCENT_INL_H_
#else
#define PRESCENE_SIMULATION_SPHERE_DESCENT_INL_H_
#endif

#include <array>
#include <bit>
#include <cmath>
#include <vector>

#include "lane_math-inl.h"
#include "lane_spheres.h"
#include "sphere_patches-inl.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::simulation::HWY_NAMESPACE {

HWY_INLINE std::array<Real, 3> lane_of(const std::array<SphereLanes::Row, 3>& rows, std::size_t lane) {
  return {rows[0][lane], rows[1][lane], rows[2][lane]};
}

/// Spheres over patches: of each lane one.
struct SpheresOver {
  Vec3<V> centre;  ///< Of the sphere.
  V radius;
  Vec3<V> patch_centre, point, normal;
  V reach;
};

/// Finds which spheres are near which patches, and of each the one that is nearest.
class SphereDescent {
 public:
  SphereDescent(const SphereQuery& query, SphereScratch& scratch)
      : query_(query),
        pairs_(scratch.pairs),
        a_(*query.spheres),
        b_(*query.others),
        R_BA_(one_lane(query.R_BS)),
        p_BA_(one_lane(query.p_BS)),
        velocity_(one_lane(query.velocity)),
        spin_(one_lane(query.spin)),
        range_(one_lane(query.range)),
        dt_(one_lane(query.dt)),
        a_is_finer_(a_.spacing <= b_.spacing) {
    const auto size = [](const std::array<Real, 3>& v) {
      return std::sqrt(static_cast<double>(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]));
    };
    travel_ = set<V>(static_cast<double>(query.dt) * (size(query.velocity) + size(query.spin) * a_.ball));
  }

  void descend() {
    const D d;
    std::vector<SpherePairs::Nodes>& stack = pairs_.stack;
    const Vec3<V> root = transposed(R_BA_, neg(p_BA_));
    stack.assign(1, {0, 0, hn::GetLane(root.x), hn::GetLane(root.y), hn::GetLane(root.z), static_cast<Real>(b_.ball)});
    HWY_ALIGN SphereLanes::Row x, y, z;
    while (!stack.empty()) {
      const SpherePairs::Nodes two = stack.back();
      stack.pop_back();
      const SphereLanes::Node& of_a = a_.nodes[static_cast<std::size_t>(two.a)];
      const SphereLanes::Node& of_b = b_.nodes[static_cast<std::size_t>(two.b)];
      std::uint32_t near_a = near_sphere(of_a, two);
      if (near_a == 0) continue;
      const auto count_b = static_cast<std::size_t>(of_b.count);
      for (std::size_t at = 0; at < count_b; at += hn::Lanes(d)) {
        const Vec3<V> centre = centres_of_b(of_b, at);
        hn::Store(centre.x, d, x.data() + at);
        hn::Store(centre.y, d, y.data() + at);
        hn::Store(centre.z, d, z.data() + at);
      }
      const auto push = [&](std::int32_t a, std::uint32_t lane) {
        stack.push_back(
            {a, of_b.first + static_cast<std::int32_t>(lane), x[lane], y[lane], z[lane], of_b.radius[lane]});
      };
      std::uint32_t any_b = 0;
      const SpherePairs::Leaves leaves =
          of_a.bottom && of_b.bottom ? leaves_of(of_a.first, of_b.first) : SpherePairs::Leaves{};
      for (; near_a != 0; near_a &= near_a - 1) {
        const auto i = static_cast<std::size_t>(std::countr_zero(near_a));
        const Vec3<V> centre{one_lane(of_a.x[i]), one_lane(of_a.y[i]), one_lane(of_a.z[i])};
        const V reach = one_lane(of_a.radius[i]) + range_;
        std::uint32_t near = 0;
        for (std::size_t at = 0; at < count_b; at += hn::Lanes(d)) {
          const Vec3<V> apart = Vec3<V>{load(x, at), load(y, at), load(z, at)} - centre;
          const V limit = reach + load(of_b.radius, at);
          near |= bits_of(D(), hn::Le(dot(apart, apart), limit * limit)) << at;
        }
        near &= (1U << count_b) - 1U;
        if (near == 0) continue;
        any_b |= near;
        const auto lane = static_cast<std::int32_t>(i);
        if (of_a.bottom && of_b.bottom) {
          meet_patches(leaves, i, near);
        } else if (!of_a.bottom && of_b.bottom) {
          stack.push_back({of_a.first + lane, two.b, two.x, two.y, two.z, two.radius});
        } else if (!of_a.bottom) {
          for (std::uint32_t bits = near; bits != 0; bits &= bits - 1)
            push(of_a.first + lane, static_cast<std::uint32_t>(std::countr_zero(bits)));
        }
      }
      if (!of_a.bottom || of_b.bottom) continue;
      for (std::uint32_t bits = any_b; bits != 0; bits &= bits - 1)
        push(two.a, static_cast<std::uint32_t>(std::countr_zero(bits)));
    }
  }

 protected:
  /// B's patches in A.
  const SphereLanes::PatchRows& placed(std::int32_t index) {
    const auto i = static_cast<std::size_t>(index);
    SphereLanes::PatchRows& rows = pairs_.placed[i];
    if (pairs_.is_placed[i] != 0) return rows;
    pairs_.is_placed[i] = 1;
    const SphereLanes::PatchRows& given = b_.patches[i];
    const auto place = [&](const std::array<SphereLanes::Row, 3>& from, std::array<SphereLanes::Row, 3>& to, bool point)
                           HWY_ATTR {
                             for (std::size_t at = 0; at < kNodeWidth; at += hn::Lanes(D())) {
                               const Vec3<V> v = load(from, at);
                               const Vec3<V> turned = transposed(R_BA_, point ? v - p_BA_ : v);
                               hn::Store(turned.x, D(), to[0].data() + at);
                               hn::Store(turned.y, D(), to[1].data() + at);
                               hn::Store(turned.z, D(), to[2].data() + at);
                             }
                           };
    place(given.centre, rows.centre, true);
    place(given.point, rows.point, true);
    place(given.normal, rows.normal, false);
    if (given.bent) {
      place(given.tangent, rows.tangent, false);
      place(given.bitangent, rows.bitangent, false);
    }
    if (given.limited)
      for (std::size_t k = 0; k < 2; ++k) place(given.out[k], rows.out[k], false);
    rows.bend = given.bend;
    rows.radius = given.radius;
    rows.reach = given.reach;
    rows.distance = given.distance;
    rows.bent = given.bent;
    rows.limited = given.limited;
    return rows;
  }

  /// Where the lowest point of a sphere will be when it gets to the patch, if only the part of its way along the patch
  /// counts. `sign` is 1 where the sphere is A's, else -1.
  HWY_INLINE Vec3<V> shift_of(const Vec3<V>& p, const Vec3<V>& normal, V up, V sign) const {
    const V zero = set<V>(0.0);
    const Vec3<V> moves = (velocity_ + cross(spin_, p)) * sign;
    const V closing = hn::Neg(dot(normal, moves));
    const M closes = hn::And(hn::Gt(up, zero), hn::Gt(closing, zero));
    const V time = hn::Min(dt_, up / select(closes, closing, set<V>(1.0)));
    const Vec3<V> shift = (moves + normal * closing) * time;
    return select(closes, shift, set3<V>(0.0, 0.0, 0.0));
  }

  static HWY_INLINE M lanes_in(std::uint32_t bits) {
    HWY_ALIGN Real values[kNodeWidth];
    for (std::size_t k = 0; k < hn::Lanes(D()); ++k) values[k] = static_cast<Real>(bits >> k & 1U);
    return hn::Gt(hn::Load(D(), values), set<V>(0.0));
  }

  const SphereQuery& query_;
  SpherePairs& pairs_;
  const SphereLanes& a_;
  const SphereLanes& b_;
  Mat3<V> R_BA_;
  Vec3<V> p_BA_, velocity_, spin_;
  V range_, dt_, travel_;
  bool a_is_finer_;

 private:
  /// The children of a node of B in A.
  HWY_INLINE Vec3<V> centres_of_b(const SphereLanes::Node& node, std::size_t at) const {
    return transposed(R_BA_, Vec3<V>{load(node.x, at), load(node.y, at), load(node.z, at)} - p_BA_);
  }

  /// Which children of a node of A's are near a node of B's.
  HWY_INLINE std::uint32_t near_sphere(const SphereLanes::Node& of_a, const SpherePairs::Nodes& two) const {
    const Vec3<V> centre{one_lane(two.x), one_lane(two.y), one_lane(two.z)};
    const V reach = one_lane(two.radius) + range_;
    const auto count = static_cast<std::size_t>(of_a.count);
    std::uint32_t near = 0;
    for (std::size_t at = 0; at < count; at += hn::Lanes(D())) {
      const Vec3<V> apart = Vec3<V>{load(of_a.x, at), load(of_a.y, at), load(of_a.z, at)} - centre;
      const V limit = reach + load(of_a.radius, at);
      near |= bits_of(D(), hn::Le(dot(apart, apart), limit * limit)) << at;
    }
    return near & ((1U << count) - 1U);
  }

  SpherePairs::Leaves leaves_of(std::int32_t rows_a, std::int32_t rows_b) {
    return {rows_a,
            rows_b,
            &a_.patches[static_cast<std::size_t>(rows_a)],
            &placed(rows_b),
            &pairs_.best_of(pairs_.best_a, rows_a),
            &pairs_.best_of(pairs_.best_b, rows_b)};
  }

  /// How far (m^2) the spheres' lowest points are from the patches' points; `over`: where they are over them.
  template <class Ends>
  HWY_INLINE V far_from(const SpheresOver& s, V sign, M& over, const Ends& ends) const {
    const D d;
    const V zero = set<V>(0.0);
    Vec3<V> to = s.centre - s.normal * s.radius - s.point;
    const V up = dot(s.normal, to);
    const V room = s.reach + travel_;
    over = hn::And(over, hn::Le(up, range_ + s.reach));
    over = hn::And(over, hn::Le(dot(to, to) - up * up, room * room));
    over = hn::And(over, hn::Gt(dot(s.centre - s.patch_centre, s.normal), zero));
    if (hn::AllFalse(d, over)) return zero;
    const M moved = hn::And(over, hn::Gt(travel_, set<V>(0.1) * s.reach));
    if (!hn::AllFalse(d, moved)) {
      const Vec3<V> shifted = to + shift_of(to + s.point, s.normal, up, sign);
      to = select(moved, shifted, to);
    }
    const V away = dot(to, to);
    over = hn::And(over, hn::Le(away - up * up, s.reach * s.reach));
    if (hn::AllFalse(d, over)) return zero;
    over = hn::AndNot(ends(to, hn::Max(zero, hn::Neg(up))), over);
    return away;
  }

  /// A sphere of A's and those of a node of B's that are near it.
  void meet_patches(const SpherePairs::Leaves& leaves, std::size_t i, std::uint32_t near) {
    const D d;
    const SphereLanes::PatchRows &of_a = *leaves.patches_a, &of_b = *leaves.patches_b;
    const bool edge = of_a.reach[i] == Real(0);
    const Vec3<V> centre = one_lane(lane_of(of_a.centre, i)), point = one_lane(lane_of(of_a.point, i)),
                  normal = one_lane(lane_of(of_a.normal, i));
    const V radius = one_lane(of_a.radius[i]), reach = one_lane(of_a.reach[i]);
    const std::int32_t rows_b = leaves.rows_b;
    const std::int32_t id_a = leaves.rows_a * kNodeWidth + static_cast<std::int32_t>(i);
    for (std::size_t at = 0; near >> at != 0; at += hn::Lanes(d)) {
      const std::uint32_t bits = near >> at & ((1U << hn::Lanes(d)) - 1U);
      if (bits == 0) continue;
      const M wanted = lanes_in(bits);
      const PatchLanes b(of_b, at);
      const std::uint32_t edges = bits_of(D(), hn::And(wanted, b.edge));
      M a_over, b_over;  // A's sphere over B's patches, B's spheres over A's patch
      if (edge) {
        for (std::uint32_t left = edges; left != 0; left &= left - 1) {
          const auto lane = static_cast<std::int32_t>(at) + static_cast<std::int32_t>(std::countr_zero(left));
          pairs_.edges.push_back({id_a, rows_b * kNodeWidth + lane});
        }
        a_over = hn::AndNot(b.edge, wanted);
        b_over = hn::Lt(reach, reach);
      } else {
        const M faces = hn::AndNot(hn::Or(b.edge, hn::Gt(dot(normal, b.normal), set<V>(kSameSide))), wanted);
        b_over = hn::And(wanted, b.edge);
        a_over = hn::Lt(reach, reach);
        (a_is_finer_ ? a_over : b_over) = hn::Or(a_is_finer_ ? a_over : b_over, faces);
      }
      V away = set<V>(1e30);
      if (!hn::AllFalse(d, a_over)) {
        const SpheresOver s{centre, radius, b.centre, b.point, b.normal, b.reach};
        const V mine = far_from(s, set<V>(1.0), a_over,
                                [&](const Vec3<V>& to, V depth) HWY_ATTR { return ends_before(b, to, depth); });
        away = select(a_over, mine, away);
      }
      if (!hn::AllFalse(d, b_over)) {
        const SpheresOver s{b.centre, b.radius, centre, point, normal, reach};
        const V mine = far_from(s, set<V>(-1.0), b_over, [&](const Vec3<V>& to, V depth) HWY_ATTR {
          M ends = hn::Lt(depth, depth);
          if (!of_a.limited) return ends;
          const V room = set<V>(kPatchRoom) - depth;
          for (std::size_t k = 0; k < 2; ++k)
            ends =
                hn::Or(ends, hn::Gt(dot(one_lane(lane_of(of_a.out[k], i)), to), one_lane(of_a.distance[k][i]) + room));
          return ends;
        });
        away = select(b_over, mine, away);
      }
      if (hn::AllFalse(d, hn::Or(a_over, b_over))) continue;
      note(away, at, i, id_a, rows_b, *leaves.best_a, *leaves.best_b);
    }
  }

  /// The nearest of each sphere and patch.
  HWY_INLINE void note(V away, std::size_t at, std::size_t i, std::int32_t id_a, std::int32_t rows_b,
                       SpherePairs::Best& best_a, SpherePairs::Best& best_b) {
    const D d;
    const V known = load(best_b.away, at);
    const M nearer = hn::Lt(away, known);
    if (!hn::AllFalse(d, nearer)) {
      hn::Store(select(nearer, away, known), d, best_b.away.data() + at);
      const V partner = load(best_b.partner, at);
      hn::Store(select(nearer, set<V>(id_a), partner), d, best_b.partner.data() + at);
    }
    const M mine = hn::Lt(away, one_lane(best_a.away[i]));
    if (hn::AllFalse(d, mine)) return;
    const Real least = hn::GetLane(hn::MinOfLanes(d, away));
    const auto lane = static_cast<std::int32_t>(std::countr_zero(bits_of(D(), hn::Eq(away, one_lane(least)))));
    best_a.away[i] = least;
    best_a.partner[i] = static_cast<Real>(rows_b * kNodeWidth + static_cast<std::int32_t>(at) + lane);
  }
};

}  // namespace prescene::simulation::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
