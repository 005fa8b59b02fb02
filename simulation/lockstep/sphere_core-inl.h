// SPDX-License-Identifier: Apache-2.0
// Spheres that stand for a surface against a convex core with round edges: SphereContactFinder::spheres_convex of
// Bullet's stepper in lanes.
#if defined(PRESCENE_SIMULATION_SPHERE_CORE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef PRESCENE_SIMULATION_SPHERE_CORE_INL_H_
#undef PRESCENE_SIMULATION_SPHERE_CORE_INL_H_
#else
#define PRESCENE_SIMULATION_SPHERE_CORE_INL_H_
#endif

#include <algorithm>
#include <bit>
#include <cmath>
#include <span>
#include <vector>

#include "lane_math-inl.h"
#include "lane_spheres.h"
#include "sphere_patches-inl.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::simulation::HWY_NAMESPACE {

/// Where a core is nearest to a point, as ConvexCore::Nearest of Bullet's stepper; the normal in B.
struct CorePlace {
  V distance;
  Vec3<V> normal;
  M flat;
};

HWY_INLINE CorePlace towards(const Vec3<V>& from_core, const Vec3<V>& otherwise) {
  const V zero = set<V>(0.0);
  const V distance = length(from_core);
  const M proper = hn::Gt(distance, zero);
  const V scale = set<V>(1.0) / select(proper, distance, set<V>(1.0));
  return {distance, select(proper, from_core * scale, otherwise), hn::Lt(zero, zero)};
}

HWY_INLINE CorePlace on_box(const Vec3<V>& low, const Vec3<V>& high, const Vec3<V>& q) {
  const V zero = set<V>(0.0);
  const V one = set<V>(1.0);
  const Vec3<V> below = low - q, above = q - high;
  const Vec3<V> beyond{hn::Max(below.x, above.x), hn::Max(below.y, above.y), hn::Max(below.z, above.z)};
  const auto sign_of = [&](V down, V up) HWY_ATTR { return select(hn::Gt(down, up), hn::Neg(one), one); };
  const Vec3<V> sign{sign_of(below.x, above.x), sign_of(below.y, above.y), sign_of(below.z, above.z)};
  const M out_x = hn::Gt(beyond.x, zero), out_y = hn::Gt(beyond.y, zero), out_z = hn::Gt(beyond.z, zero);
  const M two = hn::Or(hn::And(out_x, hn::Or(out_y, out_z)), hn::And(out_y, out_z));
  const M by_x = hn::And(hn::Ge(beyond.x, beyond.y), hn::Ge(beyond.x, beyond.z));
  const M by_y = hn::AndNot(by_x, hn::Ge(beyond.y, beyond.z));
  const M by_z = hn::Not(hn::Or(by_x, by_y));
  CorePlace place;
  place.distance = select(by_x, beyond.x, select(by_y, beyond.y, beyond.z));
  place.normal = {hn::IfThenElseZero(by_x, sign.x), hn::IfThenElseZero(by_y, sign.y), hn::IfThenElseZero(by_z, sign.z)};
  place.flat = hn::Not(two);
  if (hn::AllFalse(D(), two)) return place;
  const Vec3<V> outside{hn::Max(beyond.x, zero), hn::Max(beyond.y, zero), hn::Max(beyond.z, zero)};
  const CorePlace round = towards(times(sign, outside), set3<V>(0.0, 0.0, 1.0));
  place.distance = select(two, round.distance, place.distance);
  place.normal = select(two, round.normal, place.normal);
  return place;
}

/// Of shapes turned about z: from the half plane of (distance from the axis, z).
HWY_INLINE Vec3<V> turned_normal(V outwards, V upwards, V across, const Vec3<V>& p) {
  const V one = set<V>(1.0);
  const M proper = hn::Gt(across, set<V>(0.0));
  const V scale = one / select(proper, across, one);
  return {outwards * select(proper, p.x * scale, one), outwards * hn::IfThenElseZero(proper, p.y * scale), upwards};
}

HWY_INLINE CorePlace on_cylinder(const ConvexPart& core, const Vec3<V>& p) {
  const V zero = set<V>(0.0);
  const V one = set<V>(1.0);
  const V across = hn::Sqrt(p.x * p.x + p.y * p.y);
  const V up = select(hn::Lt(p.z, zero), hn::Neg(one), one);
  const V out = across - set<V>(core.half[0]), above = hn::Abs(p.z) - set<V>(core.half[2]);
  const M beyond = hn::And(hn::Gt(out, zero), hn::Gt(above, zero));
  const V corner = hn::Sqrt(out * out + above * above);
  const V scale = one / select(beyond, corner, one);
  const M side = hn::AndNot(beyond, hn::Ge(out, above));
  CorePlace place;
  place.distance = select(beyond, corner, select(side, out, above));
  const V outwards = select(beyond, out * scale, select(side, one, zero));
  const V upwards = up * select(beyond, above * scale, select(side, zero, one));
  place.normal = turned_normal(outwards, upwards, across, p);
  place.flat = hn::Not(hn::Or(beyond, side));
  return place;
}

HWY_INLINE CorePlace on_cone(const ConvexPart& core, const Vec3<V>& p) {
  const V zero = set<V>(0.0);
  const V one = set<V>(1.0);
  const double height = core.half[1] - core.half[2], rim = core.half[0];
  const double slant = std::sqrt(height * height + rim * rim);
  const V across = hn::Sqrt(p.x * p.x + p.y * p.y);
  const V qx = across - set<V>(rim), qz = p.z - set<V>(core.half[2]);  // from the rim
  const V nx = set<V>(height / slant), nz = set<V>(rim / slant);
  const V above_side = nx * qx + nz * qz, below_base = hn::Neg(qz);
  const M inside = hn::And(hn::Le(above_side, zero), hn::Le(below_base, zero));
  const M to_base = hn::Or(hn::AndNot(hn::Ge(above_side, below_base), inside),
                           hn::AndNot(inside, hn::And(hn::Gt(below_base, zero), hn::Le(qx, zero))));
  const V along = hn::Min(hn::Max((qz * set<V>(height) - qx * set<V>(rim)) * set<V>(1.0 / (slant * slant)), zero), one);
  const V from_x = qx + along * set<V>(rim), from_z = qz - along * set<V>(height);
  const V distance = hn::Sqrt(from_x * from_x + from_z * from_z);
  const M proper = hn::Gt(distance, zero);
  const V scale = one / select(proper, distance, one);
  CorePlace place;
  place.distance = select(to_base, below_base, select(inside, above_side, distance));
  const M by_side = hn::Or(inside, hn::Not(proper));
  const V outwards = select(to_base, zero, select(by_side, nx, from_x * scale));
  const V upwards = select(to_base, hn::Neg(one), select(by_side, nz, from_z * scale));
  place.normal = turned_normal(outwards, upwards, across, p);
  place.flat = to_base;
  return place;
}

/// Of points that are at most `limit` away; of others the distance is beyond it. `faces`: at least the one that each
/// point is highest over, and all that any of them is over, ascending.
HWY_INLINE CorePlace on_hull(const ConvexPart& core, std::span<const std::int32_t> faces, const Vec3<V>& p, V limit,
                             M wanted) {
  const D d;
  const V zero = set<V>(0.0);
  const V one = set<V>(1.0);
  CorePlace place{set<V>(-1e30), set3<V>(0.0, 0.0, 1.0), hn::Eq(zero, zero)};
  for (const std::int32_t face : faces) {
    const std::array<Real, 4>& plane = core.planes[static_cast<std::size_t>(face)];
    const Vec3<V> normal{one_lane(plane[0]), one_lane(plane[1]), one_lane(plane[2])};
    const V height = dot(normal, p) - one_lane(plane[3]);
    const M higher = hn::Gt(height, place.distance);
    place.distance = select(higher, height, place.distance);
    place.normal = select(higher, normal, place.normal);
    if (hn::AllFalse(d, hn::AndNot(hn::Gt(place.distance, limit), wanted))) return place;
  }
  M open = hn::And(hn::And(wanted, hn::Gt(place.distance, zero)), hn::Le(place.distance, limit));
  if (hn::AllFalse(d, open)) return place;
  M rim = open;
  V least = set<V>(1e30);
  Vec3<V> best = set3<V>(0.0, 0.0, 0.0);
  for (const std::int32_t face : faces) {
    const auto f = static_cast<std::size_t>(face);
    const std::array<Real, 4>& plane = core.planes[f];
    const Vec3<V> normal{one_lane(plane[0]), one_lane(plane[1]), one_lane(plane[2])};
    const V height = dot(normal, p) - one_lane(plane[3]);
    M above = hn::And(rim, hn::Gt(height, zero));
    if (hn::AllFalse(d, above)) continue;
    const std::array<double, 3>* corners = core.face_corners.data() + f * kMaxLoop;
    const int count = core.corner_counts[f];
    const M asked = above;
    for (int i = 0; i < count; ++i) {
      const std::array<double, 3>&from = corners[i], &next = corners[i + 1 < count ? i + 1 : 0];
      const std::array<double, 3> way{next[0] - from[0], next[1] - from[1], next[2] - from[2]};
      const double per_square = 1.0 / (way[0] * way[0] + way[1] * way[1] + way[2] * way[2]);
      const Vec3<V> along = set3<V>(way);
      const Vec3<V> to = p - set3<V>(from);
      const M outside = hn::And(asked, hn::Lt(dot(normal, cross(along, to)), zero));
      if (hn::AllFalse(d, outside)) continue;
      above = hn::AndNot(outside, above);
      const V share = hn::Min(hn::Max(dot(along, to) * set<V>(per_square), zero), one);
      const Vec3<V> away = to - along * share;
      const V squared = dot(away, away);
      const M nearer = hn::And(outside, hn::Lt(squared, least));
      least = select(nearer, squared, least);
      best = select(nearer, away, best);
    }
    // Over the face: nothing of the hull is nearer.
    place.distance = select(above, height, place.distance);
    place.normal = select(above, normal, place.normal);
    rim = hn::AndNot(above, rim);
    if (hn::AllFalse(d, rim)) return place;
  }
  const CorePlace round = towards(best, place.normal);
  place.distance = select(rim, round.distance, place.distance);
  place.normal = select(rim, round.normal, place.normal);
  place.flat = hn::Not(rim);
  return place;
}

/// The contacts of the spheres of a vector.
class CoreMeeting {
 public:
  CoreMeeting(const SphereQuery& query, SphereScratch& scratch)
      : query_(query),
        found_(scratch.found),
        faces_(scratch.faces),
        heights_(scratch.heights),
        R_BS_(one_lane(query.R_BS)),
        p_BS_(one_lane(query.p_BS)),
        low_(one_lane(query.low)),
        high_(one_lane(query.high)),
        radius_(set<V>(query.core->radius)),
        range_(one_lane(query.range)),
        within_(set<V>(static_cast<double>(query.range) + query.spheres->reach)) {
    if (query.core->kind != CoreKind::kHull) return;
    // The plane beyond which A's middle is farthest: most often it keeps all that is not near.
    Real most = Real(-1e30);
    for (const std::array<Real, 4>& plane : query.core->planes) {
      const Real height = plane[0] * query.p_BS[0] + plane[1] * query.p_BS[1] + plane[2] * query.p_BS[2] - plane[3];
      if (height <= most) continue;
      most = height;
      facing_ = plane;
    }
  }

  /// Which of the bounding spheres are near enough.
  HWY_INLINE M near(const SphereLanes::Node& node, std::size_t at) const {
    const V zero = set<V>(0.0);
    const Vec3<V> q = R_BS_ * Vec3<V>{load(node.x, at), load(node.y, at), load(node.z, at)};
    const V limit = load(node.radius, at) + range_ + radius_;
    const Vec3<V> below = low_ - q, above = q - high_;
    const Vec3<V> beyond{hn::Max(hn::Max(below.x, above.x), zero), hn::Max(hn::Max(below.y, above.y), zero),
                         hn::Max(hn::Max(below.z, above.z), zero)};
    M near = hn::Le(dot(beyond, beyond), limit * limit);
    if (query_.core->kind == CoreKind::kHull) {
      const Vec3<V> normal{one_lane(facing_[0]), one_lane(facing_[1]), one_lane(facing_[2])};
      near = hn::And(near, hn::Le(dot(normal, q + p_BS_) - one_lane(facing_[3]), limit));
    }
    return near;
  }

  void meet(const SphereLanes::PatchRows& rows, std::size_t at, M wanted) {
    const D d;
    const V half = set<V>(0.5);
    const V zero = set<V>(0.0);
    if (query_.core->kind == CoreKind::kHull) choose_faces(rows);
    const PatchLanes patch(rows, at);
    const CorePlace place = place_of(R_BS_ * patch.centre, patch.radius + radius_ + within_, wanted);
    const V gap = place.distance - radius_ - patch.radius;
    // What turning adds only opens a gap; a patch that bends away comes nearer by its reach at most.
    wanted = hn::And(wanted, hn::Le(gap, select(hn::Or(place.flat, patch.edge), range_, within_)));
    if (hn::AllFalse(d, wanted)) return;
    const Vec3<V> normal = transposed(R_BS_, place.normal);
    const M faces = hn::Or(patch.edge, hn::Lt(dot(patch.normal, normal), zero));
    wanted = hn::And(wanted, faces);
    // A sphere's lowest point against the core, or, at what is round of it, the core's against the patch.
    const Vec3<V> lowest = patch.centre - normal * patch.radius;
    const M by_patch = hn::AndNot(hn::Or(place.flat, patch.edge), wanted);
    ContactLanes c{lowest - normal * (half * gap), normal, gap, zero};
    wanted = hn::And(wanted, hn::Or(by_patch, stands_for(patch, lowest)));
    const Vec3<V> spin = one_lane(query_.own_spin);
    V acceleration = dot(normal, towards_center(spin, patch.centre - one_lane(query_.center)));
    if (!hn::AllFalse(d, by_patch)) {
      const Vec3<V> core = patch.centre - normal * place.distance;
      const Vec3<V> near = core + normal * radius_ - patch.point;
      const Vec3<V> out = bent_height(patch, near, dot(patch.normal, near)).normal;
      const Vec3<V> on_b = core - out * radius_;
      M over;
      const PatchHeight height = height_of(patch, on_b, over);
      over = hn::AndNot(hn::Lt(height.gap, patch.radius * set<V>(-2.0)), over);
      wanted = hn::AndNot(hn::AndNot(over, by_patch), wanted);
      c.position = select(by_patch, on_b - height.normal * (half * height.gap), c.position);
      c.normal = select(by_patch, neg(height.normal), c.normal);
      c.gap = select(by_patch, height.gap, c.gap);
      acceleration = hn::IfThenZeroElse(by_patch, acceleration);
    }
    wanted = hn::And(wanted, hn::Le(c.gap, range_));
    if (hn::AllFalse(d, wanted)) return;
    const V dt = one_lane(query_.dt);
    turn(c, acceleration, dt);
    append(c, gap_at_end(query_, c, dt), wanted, found_);
  }

 private:
  /// Faces of the hull that may be the highest below one of the centres, or that one of them may be over.
  void choose_faces(const SphereLanes::PatchRows& rows) {
    if (&rows == faces_of_) return;
    faces_of_ = &rows;
    const D d;
    const auto& planes = query_.core->plane_rows;
    const std::size_t count = planes[0].size();
    heights_.resize(count);
    const Vec3<V> p = R_BS_ * one_lane(rows.middle) + p_BS_;
    V highest = set<V>(-1e30);
    for (std::size_t f = 0; f < count; f += hn::Lanes(d)) {
      const Vec3<V> normal{hn::LoadU(d, planes[0].data() + f), hn::LoadU(d, planes[1].data() + f),
                           hn::LoadU(d, planes[2].data() + f)};
      const V height = dot(normal, p) - hn::LoadU(d, planes[3].data() + f);
      hn::StoreU(height, d, heights_.data() + f);
      highest = hn::Max(highest, height);
    }
    const Real most = hn::GetLane(hn::MaxOfLanes(d, highest));
    // 1e-5 m is more than single precision takes away.
    const V least = one_lane(std::min(most - 2 * rows.ball, -rows.ball) - Real(1e-5));
    faces_.clear();
    for (std::size_t f = 0; f < count; f += hn::Lanes(d)) {
      const std::uint32_t chosen = bits_of(D(), hn::Ge(hn::LoadU(d, heights_.data() + f), least));
      for (std::uint32_t bits = chosen; bits != 0; bits &= bits - 1)
        faces_.push_back(static_cast<std::int32_t>(f) + static_cast<std::int32_t>(std::countr_zero(bits)));
    }
  }

  /// `q` is turned into B, from A's middle.
  HWY_INLINE CorePlace place_of(const Vec3<V>& q, V limit, M wanted) const {
    const ConvexPart& core = *query_.core;
    const V zero = set<V>(0.0);
    switch (core.kind) {
      case CoreKind::kBox:
        return on_box(low_, high_, q);
      case CoreKind::kPoint:
        return towards(q + p_BS_, set3<V>(0.0, 0.0, 1.0));
      case CoreKind::kSegment: {
        const Vec3<V> p = q + p_BS_;
        const V z = set<V>(core.half[2]);
        return towards({p.x, p.y, p.z - hn::Min(hn::Max(p.z, hn::Neg(z)), z)}, set3<V>(1.0, 0.0, 0.0));
      }
      case CoreKind::kCylinder:
        return on_cylinder(core, q + p_BS_);
      case CoreKind::kCone:
        return on_cone(core, q + p_BS_);
      case CoreKind::kHull:
        return on_hull(core, faces_, q + p_BS_, limit, wanted);
      case CoreKind::kSpheres:
        break;
    }
    return {set<V>(1e30), set3<V>(0.0, 0.0, 1.0), hn::Eq(zero, zero)};
  }

  const SphereQuery& query_;
  FoundContacts& found_;
  std::vector<std::int32_t>& faces_;
  const SphereLanes::PatchRows* faces_of_ = nullptr;
  std::vector<Real>& heights_;
  Mat3<V> R_BS_;
  Vec3<V> p_BS_, low_, high_;
  V radius_, range_, within_;
  std::array<Real, 4> facing_{};
};

inline void meet_core_lanes(const SphereQuery* query, SphereScratch* scratch) {
  const SphereLanes& spheres = *query->spheres;
  const std::size_t width = hn::Lanes(D());
  scratch->found.clear();
  scratch->found.reserve(spheres.count);
  CoreMeeting meeting(*query, *scratch);
  std::vector<std::int32_t>& stack = scratch->stack;
  stack.assign(1, 0);
  while (!stack.empty()) {
    const SphereLanes::Node& node = spheres.nodes[static_cast<std::size_t>(stack.back())];
    stack.pop_back();
    for (std::size_t at = 0; at < static_cast<std::size_t>(node.count); at += width) {
      const M near = meeting.near(node, at);
      if (hn::AllFalse(D(), near)) continue;
      if (node.bottom) {
        meeting.meet(spheres.patches[static_cast<std::size_t>(node.first)], at, near);
        continue;
      }
      for (std::uint32_t bits = bits_of(D(), near); bits != 0; bits &= bits - 1)
        stack.push_back(node.first + static_cast<std::int32_t>(at) + static_cast<std::int32_t>(std::countr_zero(bits)));
    }
  }
}

}  // namespace prescene::simulation::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
