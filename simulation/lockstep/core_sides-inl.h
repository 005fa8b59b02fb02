// SPDX-License-Identifier: Apache-2.0
// Sides of convex cores in lanes of double precision: what faces a direction, as corners.
#if defined(PRESCENE_SIMULATION_CORE_SIDES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef PRESCENE_SIMULATION_CORE_SIDES_INL_H_
#undef PRESCENE_SIMULATION_CORE_SIDES_INL_H_
#else
#define PRESCENE_SIMULATION_CORE_SIDES_INL_H_
#endif

#include <algorithm>
#include <cmath>

#include "lane_math-inl.h"
#include "lane_state.h"
#include "prescene/simulation/rules/contact_rules.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::simulation::HWY_NAMESPACE {

using D = hn::CappedTag<double, kLaneMultiple>;
using V = hn::Vec<D>;
using M = hn::Mask<D>;

HWY_INLINE M all_lanes() { return hn::Eq(set<V>(0.0), set<V>(0.0)); }
HWY_INLINE M no_lanes() { return hn::Lt(set<V>(0.0), set<V>(0.0)); }

/// A side of a core: corners counter-clockwise from outside, the last one repeated where lanes have fewer.
struct Side {
  Vec3<V> corner[kMaxLoop];
  V count;       ///< Of each lane.
  int most = 0;  ///< Of any lane.
  Vec3<V> normal;
};

inline void face_of_hull(const ConvexPart& part, const Vec3<V>& direction, Side& side) {
  const D d;
  V best = set<V>(-2.0);
  V best_face = set<V>(0.0);
  for (std::size_t f = 0; f < part.normals.size(); ++f) {
    const Vec3<V> normal = set3<V>(part.normals[f]);
    const V along = dot(normal, direction);
    const auto better = hn::Gt(along, best);
    best = select(better, along, best);
    best_face = select(better, set<V>(static_cast<double>(f)), best_face);
    side.normal = select(better, normal, side.normal);
  }
  HWY_ALIGN double faces[kLaneMultiple];
  HWY_ALIGN double counts[kLaneMultiple];
  hn::Store(best_face, d, faces);
  side.most = 0;
  for (std::size_t i = 0; i < hn::Lanes(d); ++i) {
    const int count = part.corner_counts[static_cast<std::size_t>(faces[i])];
    counts[i] = count;
    side.most = std::max(side.most, count);
  }
  side.count = hn::Load(d, counts);
  for (int k = 0; k < side.most; ++k) {
    HWY_ALIGN double x[kLaneMultiple], y[kLaneMultiple], z[kLaneMultiple];
    for (std::size_t i = 0; i < hn::Lanes(d); ++i) {
      const std::array<double, 3>& corner =
          part.face_corners[static_cast<std::size_t>(faces[i]) * kMaxLoop + static_cast<std::size_t>(k)];
      x[i] = corner[0];
      y[i] = corner[1];
      z[i] = corner[2];
    }
    side.corner[k] = {hn::Load(d, x), hn::Load(d, y), hn::Load(d, z)};
  }
}

/// The side of a box from `low` to `high` that faces `direction`.
inline void side_of_box(const Vec3<V>& low, const Vec3<V>& high, const Vec3<V>& direction, Side& side) {
  const V zero = set<V>(0.0);
  const V one = set<V>(1.0);
  const Vec3<V> a{hn::Abs(direction.x), hn::Abs(direction.y), hn::Abs(direction.z)};
  const auto x_side = hn::And(hn::Ge(a.x, a.y), hn::Ge(a.x, a.z));
  const auto y_side = hn::AndNot(x_side, hn::Ge(a.y, a.z));
  const auto z_side = hn::Not(hn::Or(x_side, y_side));
  const Vec3<V> facing{select(hn::Ge(direction.x, zero), high.x, low.x),
                       select(hn::Ge(direction.y, zero), high.y, low.y),
                       select(hn::Ge(direction.z, zero), high.z, low.z)};
  const V along = select(x_side, direction.x, select(y_side, direction.y, direction.z));
  const auto front = hn::Ge(along, zero);
  const V sign = select(front, one, hn::Neg(one));
  side.normal = {hn::IfThenElseZero(x_side, sign), hn::IfThenElseZero(y_side, sign), hn::IfThenElseZero(z_side, sign)};
  side.count = set<V>(4.0);
  side.most = 4;
  // Around +x: (y, z), +y: (z, x), +z: (x, y), by (-,-) (+,-) (+,+) (-,+); the other way round for the other sides.
  for (int i = 0; i < 4; ++i) {
    const int back = 3 - i;
    const bool u_front = i == 1 || i == 2, v_front = i >= 2;
    const bool u_back = back == 1 || back == 2, v_back = back >= 2;
    const auto high_u = u_front == u_back ? (u_front ? all_lanes() : no_lanes()) : (u_front ? front : hn::Not(front));
    const auto high_v = v_front == v_back ? (v_front ? all_lanes() : no_lanes()) : (v_front ? front : hn::Not(front));
    const Vec3<V> u = select(high_u, high, low);
    const Vec3<V> v = select(high_v, high, low);
    side.corner[i] = {select(x_side, facing.x, select(y_side, v.x, u.x)),
                      select(y_side, facing.y, select(x_side, u.y, v.y)),
                      select(z_side, facing.z, select(x_side, v.z, u.z))};
  }
}

/// The side, rim, line or point of a core that faces `direction`; both in S.
inline void side_of_part(const ConvexPart& part, const Vec3<V>& direction, Side& side) {
  const V zero = set<V>(0.0);
  const V one = set<V>(1.0);
  side.normal = {zero, zero, zero};
  switch (part.kind) {
    case CoreKind::kPoint:
    case CoreKind::kSpheres:  // no core
      side.most = 0;
      side.count = zero;
      break;
    case CoreKind::kSegment:
      side.most = 2;
      side.count = set<V>(2.0);
      side.corner[0] = set3<V>(0.0, 0.0, -part.half[2]);
      side.corner[1] = set3<V>(0.0, 0.0, part.half[2]);
      break;
    case CoreKind::kBox: {
      const Vec3<V> half = set3<V>(part.half);
      side_of_box(neg(half), half, direction, side);
      break;
    }
    case CoreKind::kCylinder: {
      const V s = hn::Sqrt(direction.x * direction.x + direction.y * direction.y);
      const auto tilted = hn::Gt(s, set<V>(kFlatCap));
      const V scale = one / select(tilted, s, one);
      const V cx = select(tilted, direction.x * scale, one);
      const V cy = select(tilted, direction.y * scale, zero);
      const auto rim = hn::Gt(hn::Abs(direction.z), s);
      const auto up = hn::Gt(direction.z, zero);
      const V r = set<V>(part.half[0]);
      const V top = set<V>(part.half[2]);
      const V end = select(up, top, hn::Neg(top));
      const V sense = select(up, one, hn::Neg(one));
      side.most = kRimPoints;
      side.count = select(rim, set<V>(kRimPoints), set<V>(2.0));
      side.normal = {zero, zero, hn::IfThenElseZero(rim, sense)};
      for (int k = 0; k < kRimPoints; ++k) {
        const V c = set<V>(kRimCosine[k]);
        const V t = sense * set<V>(kRimSine[k]);
        const Vec3<V> on_rim{r * (cx * c - cy * t), r * (cx * t + cy * c), end};
        const Vec3<V> on_line{r * cx, r * cy, k == 0 ? hn::Neg(top) : top};
        side.corner[k] = select(rim, on_rim, on_line);
      }
      break;
    }
    case CoreKind::kCone: {
      // The base, or the line up the side that faces most.
      const V s = hn::Sqrt(direction.x * direction.x + direction.y * direction.y);
      const auto tilted = hn::Gt(s, set<V>(kFlatCap));
      const V scale = one / select(tilted, s, one);
      const V cx = select(tilted, direction.x * scale, one);
      const V cy = select(tilted, direction.y * scale, zero);
      const double height = part.half[1] - part.half[2];
      const double slant = std::sqrt(part.half[0] * part.half[0] + height * height);
      const V along_side = s * set<V>(height / slant) + direction.z * set<V>(part.half[0] / slant);
      const auto rim = hn::Ge(hn::Neg(direction.z), along_side);
      const V r = set<V>(part.half[0]);
      const V base = set<V>(part.half[2]);
      side.most = kRimPoints;
      side.count = select(rim, set<V>(kRimPoints), set<V>(2.0));
      side.normal = {zero, zero, hn::IfThenElseZero(rim, hn::Neg(one))};
      for (int k = 0; k < kRimPoints; ++k) {
        const V c = set<V>(kRimCosine[k]);
        const V t = set<V>(-kRimSine[k]);
        const Vec3<V> on_rim{r * (cx * c - cy * t), r * (cx * t + cy * c), base};
        const Vec3<V> on_line = k == 0 ? Vec3<V>{r * cx, r * cy, base} : Vec3<V>{zero, zero, set<V>(part.half[1])};
        side.corner[k] = select(rim, on_rim, on_line);
      }
      break;
    }
    case CoreKind::kHull:
      face_of_hull(part, direction, side);
      break;
  }
}

}  // namespace prescene::simulation::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
