// SPDX-License-Identifier: Apache-2.0
// Patches of surface in lanes: PlacedPatch of Bullet's stepper (simulation/bullet/sphere_patch.h) in single precision.
#if defined(PRESCENE_SIMULATION_SPHERE_PATCHES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef PRESCENE_SIMULATION_SPHERE_PATCHES_INL_H_
#undef PRESCENE_SIMULATION_SPHERE_PATCHES_INL_H_
#else
#define PRESCENE_SIMULATION_SPHERE_PATCHES_INL_H_
#endif

#include <bit>

#include "lane_math-inl.h"
#include "lane_spheres.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::simulation::HWY_NAMESPACE {

using D = hn::CappedTag<Real, kNodeWidth>;
using V = hn::Vec<D>;
using M = hn::Mask<D>;

HWY_INLINE V load(const SphereLanes::Row& row, std::size_t at) { return hn::Load(D(), row.data() + at); }
HWY_INLINE Vec3<V> load(const std::array<SphereLanes::Row, 3>& rows, std::size_t at) {
  return {load(rows[0], at), load(rows[1], at), load(rows[2], at)};
}
HWY_INLINE V one_lane(Real value) { return hn::Set(D(), value); }
HWY_INLINE Vec3<V> one_lane(const std::array<Real, 3>& a) { return {one_lane(a[0]), one_lane(a[1]), one_lane(a[2])}; }
HWY_INLINE Mat3<V> one_lane(const std::array<Real, 9>& m) {
  return {{one_lane(m[0]), one_lane(m[1]), one_lane(m[2])},
          {one_lane(m[3]), one_lane(m[4]), one_lane(m[5])},
          {one_lane(m[6]), one_lane(m[7]), one_lane(m[8])}};
}

/// The patches of a vector.
struct PatchLanes {
  const SphereLanes::PatchRows* rows;
  std::size_t at;
  Vec3<V> centre, point, normal;
  V radius, reach;
  M edge;

  PatchLanes(const SphereLanes::PatchRows& given, std::size_t begin)
      : rows(&given),
        at(begin),
        centre(load(given.centre, begin)),
        point(load(given.point, begin)),
        normal(load(given.normal, begin)),
        radius(load(given.radius, begin)),
        reach(load(given.reach, begin)),
        edge(hn::Eq(reach, set<V>(0.0))) {}
};

/// Whether the surface about a patch's point comes as far as there; edges stand for themselves.
HWY_INLINE M stands_for(const PatchLanes& patch, const Vec3<V>& p) {
  const Vec3<V> to = p - patch.point;
  return hn::Or(patch.edge, hn::Le(dot(to, to), patch.reach * patch.reach));
}

struct PatchHeight {
  V gap;           ///< From the patch, negative behind it.
  Vec3<V> normal;  ///< Of the patch below.
};
/// Of a place given from the patch's point, `up` over its tangent plane.
HWY_INLINE PatchHeight bent_height(const PatchLanes& patch, const Vec3<V>& to, V up) {
  const SphereLanes::PatchRows& rows = *patch.rows;
  if (!rows.bent) return {up, patch.normal};
  const Vec3<V> tangent = load(rows.tangent, patch.at), bitangent = load(rows.bitangent, patch.at);
  const Vec3<V> bend = load(rows.bend, patch.at);
  const V half = set<V>(0.5);
  const V u = dot(tangent, to), v = dot(bitangent, to);
  const V z = half * (bend.x * u * u + bend.y * u * v + bend.z * v * v);
  const V along = bend.x * u + half * bend.y * v, across = half * bend.y * u + bend.z * v;
  const Vec3<V> tilted = patch.normal - (tangent * along + bitangent * across);
  const V scale = set<V>(1.0) / length(tilted);
  return {(up - z) * scale, tilted * scale};
}

/// Whether a sharp edge ends the patch before a place, given from its point.
HWY_INLINE M ends_before(const PatchLanes& patch, const Vec3<V>& to, V depth) {
  M ends = hn::Lt(depth, depth);
  const SphereLanes::PatchRows& rows = *patch.rows;
  if (!rows.limited) return ends;
  const V room = set<V>(kPatchRoom) - depth;
  for (std::size_t k = 0; k < 2; ++k)
    ends = hn::Or(ends, hn::Gt(dot(load(rows.out[k], patch.at), to), load(rows.distance[k], patch.at) + room));
  return ends;
}

/// Of a point over the patch; `over` where it is not beside it.
HWY_INLINE PatchHeight height_of(const PatchLanes& patch, const Vec3<V>& p, M& over) {
  const V zero = set<V>(0.0);
  const Vec3<V> to = p - patch.point;
  const V up = dot(patch.normal, to);
  const V away = dot(to, to) - up * up;
  const V reach2 = patch.reach * patch.reach;
  const PatchHeight height = bent_height(patch, to, up);
  const V depth = hn::Max(zero, hn::Neg(height.gap));
  over = hn::AndNot(ends_before(patch, to, depth), hn::Le(away, reach2));
  const V shallow = hn::Max(zero, set<V>(1.0) - depth / (set<V>(kShallow) * patch.reach));
  const Vec3<V> from_centre = p - patch.centre;
  const M in_sphere = hn::Le(dot(from_centre, from_centre), patch.radius * patch.radius);
  over = hn::And(over, hn::Or(in_sphere, hn::Le(away, reach2 * shallow)));
  return height;
}

/// A contact of each lane, with what turning does to it (turn() of Bullet's stepper).
struct ContactLanes {
  Vec3<V> position, normal;  ///< S; from B to A.
  V gap, turning;
};
/// `acceleration`: of A's place towards the middle of its body, along the normal.
HWY_INLINE void turn(ContactLanes& contact, V acceleration, V dt) {
  const V zero = set<V>(0.0);
  const M turns = hn::And(hn::Ge(contact.gap, set<V>(-kRollingOverlap)), hn::Gt(acceleration, zero));
  contact.turning = hn::IfThenElseZero(turns, dt * acceleration);
  contact.gap = contact.gap + set<V>(0.5) * dt * contact.turning;
}

/// Acceleration of a place by the turning of its body.
HWY_INLINE Vec3<V> towards_center(const Vec3<V>& spin, const Vec3<V>& from_center) {
  return cross(spin, cross(spin, from_center));
}

/// Appends the lanes wanted, in their order. There must be room for a vector.
HWY_INLINE void append(const ContactLanes& c, V at_end, M wanted, FoundContacts& found) {
  const D d;
  const std::uint32_t bits = bits_of(D(), wanted);
  const auto size = static_cast<std::size_t>(found.size());
  // Compress of this Highway copies its table of a kilobyte each time.
  const auto put = [&](FoundContacts::Row row, V value) HWY_ATTR {
    HWY_ALIGN Real values[kNodeWidth];
    hn::Store(value, d, values);
    Real* to = found.row(row) + size;
    for (std::uint32_t left = bits; left != 0; left &= left - 1) *to++ = values[std::countr_zero(left)];
  };
  put(FoundContacts::kX, c.position.x);
  put(FoundContacts::kY, c.position.y);
  put(FoundContacts::kZ, c.position.z);
  put(FoundContacts::kNormalX, c.normal.x);
  put(FoundContacts::kNormalY, c.normal.y);
  put(FoundContacts::kNormalZ, c.normal.z);
  put(FoundContacts::kGap, c.gap);
  put(FoundContacts::kTurning, c.turning);
  put(FoundContacts::kAtEnd, at_end);
  found.grow(std::popcount(bits));
}

/// The gap at the end of the step if nothing were in the way.
HWY_INLINE V gap_at_end(const SphereQuery& query, const ContactLanes& c, V dt) {
  const Vec3<V> moves = one_lane(query.velocity) + cross(one_lane(query.spin), c.position);
  const V speed = dot(c.normal, moves);
  return c.gap + dt * hn::Min(set<V>(0.0), speed + set<V>(kSlow));
}

}  // namespace prescene::simulation::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
