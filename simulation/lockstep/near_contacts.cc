// SPDX-License-Identifier: Apache-2.0
// Contacts of an object with fixed boxes about their edges, and with everything else but faces: nearest points of the
// cores, then the sides that face each other along that normal, cut to their common part. Coordinates are those of the
// opposite part, B, turned and from the middle of the object's part.
#include <algorithm>
#include <cmath>

#include "lane_state.h"
#include "prescene/simulation/rules/contact_rules.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "near_contacts.cc"
#include <hwy/foreach_target.h>
// After foreach_target.h, which includes this file once for each instruction set.
#include <hwy/highway.h>

#include "core_sides-inl.h"
#include "lane_math-inl.h"
#include "nearest-inl.h"
#include "side_contacts-inl.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::simulation::HWY_NAMESPACE {

/// Pairs with boxes (B in lanes) or all with one part.
template <class OnB, class FacingB, class Deepest>
HWY_INLINE void touch_pair(const NearLanes& lanes, NearPair& pair, M wanted, const Vec3<V>& guess, const OnB& on_b,
                           const FacingB& facing_b, const Deepest& deepest, ContactStage& stage) {
  const auto on_a = [&](const Vec3<V>& direction)
                        HWY_ATTR { return pair.R_BS * support_of(*pair.part, transposed(pair.R_BS, direction)); };
  const Nearest<V> nearest = nearest_points(guess, pair.range + pair.radii, wanted, on_a, on_b);
  wanted = hn::AndNot(nearest.apart, wanted);
  if (hn::AllFalse(D(), wanted)) return;
  V distance = hn::Sqrt(nearest.squared);
  pair.normal = nearest.v * (set<V>(1.0) / select(nearest.overlap, set<V>(1.0), distance));
  Vec3<V> point = nearest.on_a;
  if (!hn::AllFalse(D(), hn::And(wanted, nearest.overlap))) {
    // The cores overlap, which only a start inside of something makes: out by the shortest way to a side of B.
    Vec3<V> normal = set3<V>(0.0, 0.0, 1.0);
    V depth = set<V>(-1e30);
    Vec3<V> lowest = point;
    deepest(on_a, normal, depth, lowest);
    pair.normal = select(nearest.overlap, normal, pair.normal);
    distance = select(nearest.overlap, depth, distance);
    point = select(nearest.overlap, lowest, point);
  }
  wanted = hn::And(wanted, hn::Le(distance - pair.radii, pair.range));
  if (hn::AllFalse(D(), wanted)) return;
  NearWriter writer(lanes, pair, stage);
  if (pair.part->kind != CoreKind::kPoint) {
    Side a, b;
    side_of_part(*pair.part, transposed(pair.R_BS, neg(pair.normal)), a);
    for (int i = 0; i < a.most; ++i) a.corner[i] = pair.R_BS * a.corner[i];
    a.normal = pair.R_BS * a.normal;
    facing_b(pair.normal, b);
    cut_common(pair, a, b, wanted, writer);
  }
  const auto covered = hn::Le(writer.lowest(), distance - pair.radii + set<V>(kSameGap));
  writer.add(point, distance, hn::AndNot(covered, wanted));
}

HWY_INLINE Vec3<V> column(const double (&rows)[3][kLaneMultiple]) {
  const D d;
  return {hn::Load(d, rows[0]), hn::Load(d, rows[1]), hn::Load(d, rows[2])};
}
HWY_INLINE Mat3<V> matrix(const double (&rows)[9][kLaneMultiple]) {
  const D d;
  return {{hn::Load(d, rows[0]), hn::Load(d, rows[1]), hn::Load(d, rows[2])},
          {hn::Load(d, rows[3]), hn::Load(d, rows[4]), hn::Load(d, rows[5])},
          {hn::Load(d, rows[6]), hn::Load(d, rows[7]), hn::Load(d, rows[8])}};
}

/// The objects of the pairs; lanes beyond the last pair repeat it.
void gather_objects(const ConvexPart& part, const LanePairs::Near* pairs, std::size_t filled, const LaneState& state,
                    NearLanes& lanes) {
  const std::size_t width = hn::Lanes(D());
  lanes.valid = (1U << filled) - 1U;
  for (std::size_t i = 0; i < width; ++i) {
    const std::int32_t object = pairs[std::min(i, filled - 1)].object;
    for (std::size_t k = 0; k < 9; ++k) lanes.R[k][i] = static_cast<double>(state.R[k][object]);
    for (std::size_t k = 0; k < 3; ++k) {
      lanes.center[k][i] = static_cast<double>(state.p[k][object]);
      lanes.middle[k][i] = part.center[k] - static_cast<double>(state.com[k][object]);
    }
    lanes.range[i] = static_cast<double>(state.travel[object]) + kContactMargin;
    lanes.object[i] = object;
  }
}

void gather_boxes(const LockstepScene& scene, const LanePairs::Near* pairs, std::size_t filled, NearLanes& lanes) {
  for (std::size_t i = 0; i < hn::Lanes(D()); ++i) {
    const std::int32_t other = pairs[std::min(i, filled - 1)].other;
    const ConvexPart& box = scene.fixed[static_cast<std::size_t>(other)].shape;
    for (std::size_t k = 0; k < 9; ++k) lanes.R_WB[k][i] = box.R_PS[k];
    for (std::size_t k = 0; k < 3; ++k) {
      lanes.p_WB[k][i] = box.center[k];
      lanes.core[k][i] = box.half[k];
    }
    lanes.radius[i] = box.radius;
    lanes.part[i] = other;
  }
}

void touch_boxes_lanes(const LockstepScene* scene, const ConvexPart* given, const LanePairs::Near* pairs,
                       std::size_t count, LaneState* state) {
  const D d;
  const ConvexPart& part = *given;
  const std::size_t width = hn::Lanes(d);
  const V zero = set<V>(0.0);
  NearLanes lanes;
  ContactStage stage;
  for (std::size_t begin = 0; begin < count; begin += width) {
    const std::size_t filled = std::min(width, count - begin);
    gather_objects(part, pairs + begin, filled, *state, lanes);
    gather_boxes(*scene, pairs + begin, filled, lanes);
    const Mat3<V> R = matrix(lanes.R);
    const Mat3<V> R_WB = matrix(lanes.R_WB);
    NearPair pair;
    pair.part = &part;
    pair.middle = column(lanes.middle);
    const Mat3<V> R_BP = transposed_times(R_WB, R);
    pair.R_PB = transpose(R_BP);
    pair.R_BS = R_BP * set_matrix<V>(part.R_PS);
    pair.range = hn::Load(d, lanes.range);
    pair.radius_a = set<V>(part.radius);
    pair.radii = pair.radius_a + hn::Load(d, lanes.radius);
    const Vec3<V> c = transposed(R_WB, column(lanes.center) + R * pair.middle - column(lanes.p_WB));
    const Vec3<V> core = column(lanes.core);
    // What is far from the object is cut off the box, so that large boxes cost no digits.
    const V reach = set<V>(part.ball) + pair.range + set<V>(2.0) * pair.radii;
    const Vec3<V> whole_low = neg(core) - c;
    const Vec3<V> whole_high = core - c;
    const Vec3<V> low{hn::Max(whole_low.x, hn::Neg(reach)), hn::Max(whole_low.y, hn::Neg(reach)),
                      hn::Max(whole_low.z, hn::Neg(reach))};
    const Vec3<V> high{hn::Min(whole_high.x, reach), hn::Min(whole_high.y, reach), hn::Min(whole_high.z, reach)};
    const auto wanted = hn::And(hn::Le(low.x, high.x), hn::And(hn::Le(low.y, high.y), hn::Le(low.z, high.z)));
    const auto on_b = [&](const Vec3<V>& direction) HWY_ATTR {
      return Vec3<V>{select(hn::Ge(direction.x, zero), high.x, low.x), select(hn::Ge(direction.y, zero), high.y, low.y),
                     select(hn::Ge(direction.z, zero), high.z, low.z)};
    };
    const auto facing_b = [&](const Vec3<V>& direction, Side& side)
                              HWY_ATTR { side_of_box(low, high, direction, side); };
    const auto deepest = [&](const auto& on_a, Vec3<V>& normal, V& depth, Vec3<V>& lowest) HWY_ATTR {
      for (int face = 0; face < 6; ++face) {
        const double sign = face < 3 ? 1.0 : -1.0;
        const Vec3<V> n = set3<V>(face % 3 == 0 ? sign : 0.0, face % 3 == 1 ? sign : 0.0, face % 3 == 2 ? sign : 0.0);
        const Vec3<V> point = on_a(neg(n));
        const V out = dot(n, point - (sign > 0.0 ? whole_high : whole_low));
        const auto better = hn::Gt(out, depth);
        normal = select(better, n, normal);
        depth = select(better, out, depth);
        lowest = select(better, point, lowest);
      }
    };
    // From the box's nearest point to the middle of the object.
    const Vec3<V> guess{hn::Neg(hn::Min(hn::Max(zero, low.x), high.x)), hn::Neg(hn::Min(hn::Max(zero, low.y), high.y)),
                        hn::Neg(hn::Min(hn::Max(zero, low.z), high.z))};
    touch_pair(lanes, pair, wanted, guess, on_b, facing_b, deepest, stage);
    stage.flush(lanes.object, *state);
  }
}

/// Directions out of a core that overlaps another: those of its sides and, where it is round, towards `c`, in B.
template <class Try>
HWY_INLINE void try_ways_out(const ConvexPart& b, const Vec3<V>& c, const Try& try_normal) {
  const V zero = set<V>(0.0);
  const auto unit = [&](const Vec3<V>& a) HWY_ATTR {
    const V size = length(a);
    const auto proper = hn::Gt(size, zero);
    return select(proper, a * (set<V>(1.0) / select(proper, size, set<V>(1.0))), set3<V>(1.0, 0.0, 0.0));
  };
  switch (b.kind) {
    case CoreKind::kPoint:
    case CoreKind::kSegment: {
      const V z = set<V>(b.half[2]);
      try_normal(unit({c.x, c.y, c.z - hn::Min(hn::Max(c.z, hn::Neg(z)), z)}));
      break;
    }
    case CoreKind::kBox:
      for (const double sign : {1.0, -1.0}) {
        try_normal(set3<V>(sign, 0.0, 0.0));
        try_normal(set3<V>(0.0, sign, 0.0));
        try_normal(set3<V>(0.0, 0.0, sign));
      }
      break;
    case CoreKind::kCylinder:
      try_normal(set3<V>(0.0, 0.0, 1.0));
      try_normal(set3<V>(0.0, 0.0, -1.0));
      try_normal(unit({c.x, c.y, zero}));
      break;
    case CoreKind::kCone: {
      const double height = b.half[1] - b.half[2];
      const double slant = std::sqrt(b.half[0] * b.half[0] + height * height);
      const Vec3<V> out = unit({c.x, c.y, zero});
      try_normal(set3<V>(0.0, 0.0, -1.0));
      try_normal(Vec3<V>{out.x * set<V>(height / slant), out.y * set<V>(height / slant), set<V>(b.half[0] / slant)});
      break;
    }
    case CoreKind::kHull:
      for (const std::array<double, 3>& normal : b.normals) try_normal(set3<V>(normal));
      break;
    case CoreKind::kSpheres:  // no core
      break;
  }
}

void touch_shape_lanes(const LockstepScene* scene, const ConvexPart* given, int other, const LanePairs::Near* pairs,
                       std::size_t count, LaneState* state) {
  const D d;
  const ConvexPart& part = *given;
  const PartId& id = scene->parts[static_cast<std::size_t>(other)];
  const bool fixed = id.body < 0;
  const ConvexPart& b = scene->part_of(id);
  const std::size_t width = hn::Lanes(d);
  const V zero = set<V>(0.0);
  const Mat3<V> R_BodyB = set_matrix<V>(b.R_PS);
  NearLanes lanes;
  ContactStage stage;
  for (std::int32_t& one : lanes.part) one = other;
  for (std::size_t begin = 0; begin < count; begin += width) {
    const std::size_t filled = std::min(width, count - begin);
    gather_objects(part, pairs + begin, filled, *state, lanes);
    Mat3<V> R_WB = R_BodyB;
    Vec3<V> p_WB = set3<V>(b.center);
    V range = hn::Load(d, lanes.range);
    if (!fixed) {
      HWY_ALIGN double travel[kLaneMultiple], com[3][kLaneMultiple];
      for (std::size_t i = 0; i < width; ++i) {
        const std::int32_t at = pairs[begin + std::min(i, filled - 1)].other;
        for (std::size_t k = 0; k < 9; ++k) lanes.R_WB[k][i] = static_cast<double>(state->R[k][at]);
        for (std::size_t k = 0; k < 3; ++k) {
          lanes.p_WB[k][i] = static_cast<double>(state->p[k][at]);
          com[k][i] = static_cast<double>(state->com[k][at]);
        }
        travel[i] = static_cast<double>(state->travel[at]);
      }
      const Mat3<V> R_WBody = matrix(lanes.R_WB);
      p_WB = column(lanes.p_WB) + R_WBody * (p_WB - column(com));
      R_WB = R_WBody * R_BodyB;
      range = range + hn::Load(d, travel);
    }
    const Mat3<V> R = matrix(lanes.R);
    NearPair pair;
    pair.part = &part;
    pair.middle = column(lanes.middle);
    const Mat3<V> R_BP = transposed_times(R_WB, R);
    pair.R_PB = transpose(R_BP);
    pair.R_BS = R_BP * set_matrix<V>(part.R_PS);
    pair.range = range;
    pair.radius_a = set<V>(part.radius);
    pair.radii = set<V>(part.radius + b.radius);
    const Vec3<V> c = transposed(R_WB, column(lanes.center) + R * pair.middle - p_WB);
    const auto on_b = [&](const Vec3<V>& direction) HWY_ATTR { return support_of(b, direction) - c; };
    const auto facing_b = [&](const Vec3<V>& direction, Side& side) HWY_ATTR {
      side_of_part(b, direction, side);
      for (int i = 0; i < side.most; ++i) side.corner[i] = side.corner[i] - c;
    };
    const auto deepest = [&](const auto& on_a, Vec3<V>& normal, V& depth, Vec3<V>& lowest) HWY_ATTR {
      try_ways_out(b, c, [&](const Vec3<V>& n) HWY_ATTR {
        const Vec3<V> point = on_a(neg(n));
        const V out = dot(n, point - on_b(n));
        const auto better = hn::Gt(out, depth);
        normal = select(better, n, normal);
        depth = select(better, out, depth);
        lowest = select(better, point, lowest);
      });
    };
    // GJK begins with the line of the middles, which must have a direction.
    const auto apart = hn::Gt(dot(c, c), zero);
    touch_pair(lanes, pair, all_lanes(), select(apart, c, set3<V>(0.0, 0.0, 1.0)), on_b, facing_b, deepest, stage);
    stage.flush(lanes.object, *state);
  }
}

}  // namespace prescene::simulation::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace prescene::simulation {

HWY_EXPORT(touch_boxes_lanes);
HWY_EXPORT(touch_shape_lanes);

void touch_boxes(const LockstepScene& scene, const ConvexPart& part, std::span<const LanePairs::Near> pairs,
                 LaneState& state) {
  if (pairs.empty()) return;
  HWY_DYNAMIC_DISPATCH(touch_boxes_lanes)(&scene, &part, pairs.data(), pairs.size(), &state);
}

void touch_shape(const LockstepScene& scene, const ConvexPart& part, int other, std::span<const LanePairs::Near> pairs,
                 LaneState& state) {
  if (pairs.empty()) return;
  HWY_DYNAMIC_DISPATCH(touch_shape_lanes)(&scene, &part, other, pairs.data(), pairs.size(), &state);
}

}  // namespace prescene::simulation
#endif
