// SPDX-License-Identifier: Apache-2.0
// Contacts of the object with boxes about their edges, and with hulls: nearest points of the cores, then the sides that
// face each other along that normal, cut to their common part. Coordinates are those of the fixed part, B, turned and
// from the middle of the object's part.
#include <algorithm>
#include <cmath>

#include "lane_state.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "near_contacts.cc"
#include <hwy/foreach_target.h>
// After foreach_target.h, which includes this file once for each instruction set.
#include <hwy/highway.h>

#include "lane_math-inl.h"
#include "nearest-inl.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::simulation::HWY_NAMESPACE {

using D = hn::CappedTag<double, kLaneMultiple>;
using V = hn::Vec<D>;
using M = hn::Mask<D>;

// Sides that are steeper than this against the normal are not cut: their points are far apart along it.
constexpr double kSteepest = 0.2;
// m: a nearest point this much closer than all others is a contact of its own.
constexpr double kSameGap = 1e-7;

HWY_INLINE M all_lanes() { return hn::Eq(set<V>(0.0), set<V>(0.0)); }
HWY_INLINE M no_lanes() { return hn::Lt(set<V>(0.0), set<V>(0.0)); }
HWY_INLINE std::uint32_t bits_of(M mask) {
  std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(D(), mask, bytes);
  return bytes[0] | static_cast<std::uint32_t>(bytes[1]) << 8;
}

/// A side of a core: corners counter-clockwise from outside, the last one repeated where lanes have fewer.
struct Side {
  Vec3<V> corner[kMaxLoop];
  V count;       ///< Of each lane.
  int most = 0;  ///< Of any lane.
  Vec3<V> normal;
};

void face_of_hull(const ConvexPart& part, const Vec3<V>& direction, Side& side) {
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
void side_of_box(const Vec3<V>& low, const Vec3<V>& high, const Vec3<V>& direction, Side& side) {
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

/// The side, rim, line or point of the object's part that faces `direction`; both in S.
void side_of_part(const ConvexPart& part, const Vec3<V>& direction, Side& side) {
  constexpr double kFlat = 1e-3;  // rad: up to it a rim keeps its points
  const V zero = set<V>(0.0);
  const V one = set<V>(1.0);
  side.normal = {zero, zero, zero};
  switch (part.kind) {
    case CoreKind::kPoint:
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
      const auto tilted = hn::Gt(s, set<V>(kFlat));
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
    case CoreKind::kHull:
      face_of_hull(part, direction, side);
      break;
  }
}

struct NearLanes {
  HWY_ALIGN double R[9][kLaneMultiple];
  HWY_ALIGN double center[3][kLaneMultiple];  ///< Middle of the object's part, W.
  HWY_ALIGN double middle[3][kLaneMultiple];  ///< The same from the centre of mass, P.
  HWY_ALIGN double range[kLaneMultiple];
  HWY_ALIGN double R_WB[9][kLaneMultiple];
  HWY_ALIGN double p_WB[3][kLaneMultiple];
  HWY_ALIGN double core[3][kLaneMultiple];
  HWY_ALIGN double radius[kLaneMultiple];  ///< Of the fixed core.
  std::int32_t slot[kLaneMultiple];
  std::int32_t part[kLaneMultiple];
  std::uint32_t valid;
};

/// A pair in lanes.
struct NearPair {
  const ConvexPart* part;
  Mat3<V> R_BS;  ///< From the object's part to B.
  Mat3<V> R_PB;
  Vec3<V> middle;
  Vec3<V> normal;  ///< From B to the object, B.
  V range, radius_a, radii;
};

/// Appends points to the contacts of their slots.
class NearWriter {
 public:
  NearWriter(const NearLanes& lanes, const NearPair& pair, ContactStage& stage)
      : lanes_(lanes), pair_(pair), stage_(stage), lowest_(set<V>(1e30)) {
    const D d;
    const Vec3<V> n = pair.R_PB * pair.normal;
    hn::Store(n.x, d, normal_[0]);
    hn::Store(n.y, d, normal_[1]);
    hn::Store(n.z, d, normal_[2]);
  }
  V lowest() const { return lowest_; }

  /// A point of the object's core; `distance`: of the cores there, along the normal.
  void add(const Vec3<V>& core, V distance, M mask) {
    const D d;
    const V gap = distance - pair_.radii;
    mask = hn::And(mask, hn::Le(gap, pair_.range));
    lowest_ = select(mask, hn::Min(lowest_, gap), lowest_);
    std::uint32_t bits = bits_of(mask) & lanes_.valid;
    if (bits == 0) return;
    const Vec3<V> middle = pair_.middle + pair_.R_PB * (core - pair_.normal * (pair_.radius_a + set<V>(0.5) * gap));
    HWY_ALIGN double x[kLaneMultiple], y[kLaneMultiple], z[kLaneMultiple], g[kLaneMultiple];
    hn::Store(middle.x, d, x);
    hn::Store(middle.y, d, y);
    hn::Store(middle.z, d, z);
    hn::Store(gap, d, g);
    for (int i = 0; bits != 0; ++i, bits >>= 1) {
      if (!(bits & 1U)) continue;
      const auto real = [](double value) { return static_cast<Real>(value); };
      stage_.add(i, {{real(x[i]), real(y[i]), real(z[i])},
                     {real(normal_[0][i]), real(normal_[1][i]), real(normal_[2][i])},
                     real(g[i]),
                     lanes_.part[i],
                     0,
                     0});
    }
  }

 private:
  const NearLanes& lanes_;
  const NearPair& pair_;
  ContactStage& stage_;
  V lowest_;
  HWY_ALIGN double normal_[3][kLaneMultiple];
};

/// The common part of two sides along the normal, as points.
void cut_sides(const NearPair& pair, const Side& a, const Side& b, M wanted, NearWriter& writer) {
  const V zero = set<V>(0.0);
  const V one = set<V>(1.0);
  const Vec3<V>& n = pair.normal;
  const V steep_b = dot(b.normal, n);
  const auto cut = hn::And(wanted, hn::Ge(hn::Abs(steep_b), set<V>(kSteepest)));
  if (a.most < 2 || hn::AllFalse(D(), cut)) return;

  // The object's corners, moved along n into b's plane, against b's sides.
  const V scale_b = one / select(cut, steep_b, one);
  V distance[kMaxLoop];
  V height[kMaxLoop][kMaxLoop];
  Vec3<V> inward[kMaxLoop];
  for (int j = 0; j < b.most; ++j) inward[j] = cross(b.normal, b.corner[j + 1 < b.most ? j + 1 : 0] - b.corner[j]);
  for (int i = 0; i < a.most; ++i) {
    const V move = dot(b.normal, b.corner[0] - a.corner[i]) * scale_b;
    const Vec3<V> moved = a.corner[i] + n * move;
    distance[i] = hn::Neg(move);
    auto inside = hn::And(cut, hn::Lt(set<V>(i), a.count));
    for (int j = 0; j < b.most; ++j) {
      height[i][j] = dot(inward[j], moved - b.corner[j]);
      inside = hn::And(inside, hn::Ge(height[i][j], zero));
    }
    writer.add(a.corner[i], distance[i], inside);
  }
  // Where the object's sides enter and leave b's.
  const int edges = a.most == 2 ? 1 : a.most;
  for (int i = 0; i < edges; ++i) {
    const int next = i + 1 < a.most ? i + 1 : 0;
    // Lanes with fewer corners repeat the last one; from there the last side leads back. A line has no way back.
    auto crosses = cut;
    if (edges > 1) {
      crosses = hn::And(cut, i == edges - 1 ? hn::Gt(a.count, set<V>(2.0)) : hn::Lt(set<V>(i + 1), a.count));
    }
    V from = zero;
    V to = one;
    for (int j = 0; j < b.most; ++j) {
      const V h0 = height[i][j];
      const V h1 = height[next][j];
      const auto out_0 = hn::Lt(h0, zero);
      const auto out_1 = hn::Lt(h1, zero);
      crosses = hn::AndNot(hn::And(out_0, out_1), crosses);
      const auto changes = hn::Xor(out_0, out_1);
      if (hn::AllFalse(D(), hn::And(changes, crosses))) continue;
      const V s = h0 / select(changes, h0 - h1, one);
      from = select(hn::And(changes, out_0), hn::Max(from, s), from);
      to = select(hn::And(changes, out_1), hn::Min(to, s), to);
    }
    crosses = hn::And(crosses, hn::Lt(from, to));
    if (hn::AllFalse(D(), crosses)) continue;
    const Vec3<V> along = a.corner[next] - a.corner[i];
    const V opens = distance[next] - distance[i];
    writer.add(a.corner[i] + along * from, distance[i] + opens * from, hn::And(crosses, hn::Gt(from, zero)));
    writer.add(a.corner[i] + along * to, distance[i] + opens * to, hn::And(crosses, hn::Lt(to, one)));
  }
  // b's corners, moved into the plane of the object's side.
  const V steep_a = dot(a.normal, n);
  const auto area = hn::And(cut, hn::And(hn::Gt(a.count, set<V>(2.0)), hn::Ge(hn::Abs(steep_a), set<V>(kSteepest))));
  if (hn::AllFalse(D(), area)) return;
  const V scale_a = one / select(area, steep_a, one);
  const Vec3<V> axis = select(hn::Gt(steep_a, zero), n, neg(n));
  for (int i = 0; i < a.most; ++i) inward[i] = cross(axis, a.corner[i + 1 < a.most ? i + 1 : 0] - a.corner[i]);
  for (int j = 0; j < b.most; ++j) {
    auto inside = hn::And(area, hn::Lt(set<V>(j), b.count));
    for (int i = 0; i < a.most; ++i) {
      inside = hn::And(inside, hn::Ge(dot(inward[i], b.corner[j] - a.corner[i]), zero));
    }
    if (hn::AllFalse(D(), inside)) continue;
    const V gap = dot(a.normal, a.corner[0] - b.corner[j]) * scale_a;
    writer.add(b.corner[j] + n * gap, gap, inside);
  }
}

/// Pairs with boxes (B in lanes) or with one hull.
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
    cut_sides(pair, a, b, wanted, writer);
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

void gather(const LockstepScene& scene, const ConvexPart& part, const LanePairs::Near* pairs, std::size_t filled,
            const LaneState& state, NearLanes& lanes) {
  const std::size_t width = hn::Lanes(D());
  lanes.valid = (1U << filled) - 1U;
  for (std::size_t i = 0; i < width; ++i) {
    const LanePairs::Near& pair = pairs[std::min(i, filled - 1)];
    const FixedPart& fixed = scene.fixed[static_cast<std::size_t>(pair.fixed)];
    const std::int32_t slot = pair.slot;
    for (std::size_t k = 0; k < 9; ++k) {
      lanes.R[k][i] = static_cast<double>(state.R[k][slot]);
      lanes.R_WB[k][i] = fixed.R_WB[k];
    }
    for (std::size_t k = 0; k < 3; ++k) {
      lanes.center[k][i] = static_cast<double>(state.p[k][slot]);
      lanes.middle[k][i] = part.center[k] - static_cast<double>(state.com[k][slot]);
      lanes.p_WB[k][i] = fixed.shape.center[k];
      lanes.core[k][i] = fixed.shape.half[k];
    }
    lanes.radius[i] = fixed.shape.radius;
    lanes.range[i] = static_cast<double>(state.travel[slot]) + kLaneMargin;
    lanes.slot[i] = slot;
    lanes.part[i] = pair.fixed;
  }
}

void touch_boxes_lanes(const LockstepScene* scene, int part_index, const LanePairs::Near* pairs, std::size_t count,
                       LaneState* state) {
  const D d;
  const ConvexPart& part = scene->parts[static_cast<std::size_t>(part_index)];
  const std::size_t width = hn::Lanes(d);
  const V zero = set<V>(0.0);
  NearLanes lanes;
  ContactStage stage;
  for (std::size_t begin = 0; begin < count; begin += width) {
    gather(*scene, part, pairs + begin, std::min(width, count - begin), *state, lanes);
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
    stage.flush(lanes.slot, *state);
  }
}

void touch_hull_lanes(const LockstepScene* scene, int part_index, const LanePairs::Near* pairs, std::size_t count,
                      LaneState* state) {
  const D d;
  const ConvexPart& part = scene->parts[static_cast<std::size_t>(part_index)];
  const std::size_t width = hn::Lanes(d);
  NearLanes lanes;
  ContactStage stage;
  const ConvexPart& hull = scene->fixed[static_cast<std::size_t>(pairs[0].fixed)].shape;
  for (std::size_t begin = 0; begin < count; begin += width) {
    gather(*scene, part, pairs + begin, std::min(width, count - begin), *state, lanes);
    const Mat3<V> R = matrix(lanes.R);
    NearPair pair;
    pair.part = &part;
    pair.middle = column(lanes.middle);
    pair.R_PB = transpose(R);
    pair.R_BS = R * set_matrix<V>(part.R_PS);
    pair.range = hn::Load(d, lanes.range);
    pair.radius_a = set<V>(part.radius);
    pair.radii = pair.radius_a + hn::Load(d, lanes.radius);
    const Vec3<V> c = column(lanes.center) + R * pair.middle - column(lanes.p_WB);
    const auto on_b = [&](const Vec3<V>& direction) HWY_ATTR { return support_of(hull, direction) - c; };
    const auto facing_b = [&](const Vec3<V>& direction, Side& side) HWY_ATTR {
      face_of_hull(hull, direction, side);
      for (int i = 0; i < side.most; ++i) side.corner[i] = side.corner[i] - c;
    };
    const auto deepest = [&](const auto& on_a, Vec3<V>& normal, V& depth, Vec3<V>& lowest) HWY_ATTR {
      for (std::size_t f = 0; f < hull.normals.size(); ++f) {
        const Vec3<V> n = set3<V>(hull.normals[f]);
        const Vec3<V> point = on_a(neg(n));
        const V out = dot(n, point + c - set3<V>(hull.face_corners[f * kMaxLoop]));
        const auto better = hn::Gt(out, depth);
        normal = select(better, n, normal);
        depth = select(better, out, depth);
        lowest = select(better, point, lowest);
      }
    };
    touch_pair(lanes, pair, all_lanes(), c, on_b, facing_b, deepest, stage);
    stage.flush(lanes.slot, *state);
  }
}

}  // namespace prescene::simulation::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace prescene::simulation {

HWY_EXPORT(touch_boxes_lanes);
HWY_EXPORT(touch_hull_lanes);

void touch_boxes(const LockstepScene& scene, int part, std::span<const LanePairs::Near> pairs, LaneState& state) {
  if (pairs.empty()) return;
  HWY_DYNAMIC_DISPATCH(touch_boxes_lanes)(&scene, part, pairs.data(), pairs.size(), &state);
}

void touch_hull(const LockstepScene& scene, int part, std::span<const LanePairs::Near> pairs, LaneState& state) {
  if (pairs.empty()) return;
  HWY_DYNAMIC_DISPATCH(touch_hull_lanes)(&scene, part, pairs.data(), pairs.size(), &state);
}

}  // namespace prescene::simulation
#endif
