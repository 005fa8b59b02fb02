// SPDX-License-Identifier: Apache-2.0
// Contacts of two sides that face each other in lanes: cut to their common part along the normal. Coordinates are those
// of the opposite part, B, turned and from the middle of the object's part.
#if defined(PRESCENE_SIMULATION_SIDE_CONTACTS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef PRESCENE_SIMULATION_SIDE_CONTACTS_INL_H_
#undef PRESCENE_SIMULATION_SIDE_CONTACTS_INL_H_
#else
#define PRESCENE_SIMULATION_SIDE_CONTACTS_INL_H_
#endif

#include "core_sides-inl.h"
#include "lane_math-inl.h"
#include "lane_state.h"
#include "prescene/simulation/rules/contact_rules.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::simulation::HWY_NAMESPACE {

/// What a vector of pairs needs of its objects and their opposite parts, B.
struct NearLanes {
  HWY_ALIGN double R[9][kLaneMultiple];
  HWY_ALIGN double center[3][kLaneMultiple];  ///< Centre of mass, W.
  HWY_ALIGN double middle[3][kLaneMultiple];  ///< Of the object's part from there, P.
  HWY_ALIGN double range[kLaneMultiple];
  HWY_ALIGN double R_WB[9][kLaneMultiple];
  HWY_ALIGN double p_WB[3][kLaneMultiple];
  HWY_ALIGN double core[3][kLaneMultiple];
  HWY_ALIGN double radius[kLaneMultiple];  ///< Of B's core.
  std::int32_t object[kLaneMultiple];
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

/// Appends points to the contacts of their objects.
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
    std::uint32_t bits = bits_of(D(), mask) & lanes_.valid;
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

/// The common part of two sides along the normal, as points. B's has more than two corners.
inline void cut_sides(const NearPair& pair, const Side& a, const Side& b, M wanted, NearWriter& writer) {
  const V zero = set<V>(0.0);
  const V one = set<V>(1.0);
  const Vec3<V>& n = pair.normal;
  const V steep_b = dot(b.normal, n);
  const auto cut = hn::And(wanted, hn::Ge(hn::Abs(steep_b), set<V>(kSteepestFeature)));
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
  const auto area =
      hn::And(cut, hn::And(hn::Gt(a.count, set<V>(2.0)), hn::Ge(hn::Abs(steep_a), set<V>(kSteepestFeature))));
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

/// The part of B's line that is over the object's side.
inline void cut_line(const NearPair& pair, const Side& a, const Side& b, M wanted, NearWriter& writer) {
  const V zero = set<V>(0.0);
  const V one = set<V>(1.0);
  const Vec3<V>& n = pair.normal;
  const V steep = dot(a.normal, n);
  auto cut = hn::And(wanted, hn::Ge(hn::Abs(steep), set<V>(kSteepestFeature)));
  if (hn::AllFalse(D(), cut)) return;
  const Vec3<V> axis = select(hn::Gt(steep, zero), n, neg(n));
  const Vec3<V> along = b.corner[1] - b.corner[0];
  V from = zero;
  V to = one;
  for (int i = 0; i < a.most; ++i) {
    // From the last corner back to the first; lanes with fewer repeat theirs, which cuts nothing.
    const Vec3<V> inward = cross(axis, a.corner[i + 1 < a.most ? i + 1 : 0] - a.corner[i]);
    const V h0 = dot(inward, b.corner[0] - a.corner[i]);
    const V h1 = dot(inward, b.corner[1] - a.corner[i]);
    const auto out_0 = hn::Lt(h0, zero);
    const auto out_1 = hn::Lt(h1, zero);
    cut = hn::AndNot(hn::And(out_0, out_1), cut);
    const auto changes = hn::Xor(out_0, out_1);
    const V s = h0 / select(changes, h0 - h1, one);
    from = select(hn::And(changes, out_0), hn::Max(from, s), from);
    to = select(hn::And(changes, out_1), hn::Min(to, s), to);
  }
  cut = hn::And(cut, hn::Lt(from, to));
  if (hn::AllFalse(D(), cut)) return;
  const V scale = one / select(cut, steep, one);
  for (const V& s : {from, to}) {
    const Vec3<V> point = b.corner[0] + along * s;
    const V gap = dot(a.normal, a.corner[0] - point) * scale;
    writer.add(point + n * gap, gap, cut);
  }
}

/// The common part of two parallel lines.
inline void cut_parallel_lines(const NearPair& pair, const Side& a, const Side& b, M wanted, NearWriter& writer) {
  const V zero = set<V>(0.0);
  const V one = set<V>(1.0);
  const Vec3<V> u = a.corner[1] - a.corner[0];
  const Vec3<V> v = b.corner[1] - b.corner[0];
  const V uu = dot(u, u);
  const Vec3<V> across = cross(u, v);
  auto cut = hn::And(wanted, hn::Gt(uu, zero));
  cut = hn::And(cut, hn::Le(dot(across, across), set<V>(kParallelEdges * kParallelEdges) * uu * dot(v, v)));
  const V per_uu = one / select(cut, uu, one);
  const V s0 = dot(u, b.corner[0] - a.corner[0]) * per_uu;
  const V s1 = dot(u, b.corner[1] - a.corner[0]) * per_uu;
  const V low = hn::Max(zero, hn::Min(s0, s1));
  const V high = hn::Min(one, hn::Max(s0, s1));
  cut = hn::And(cut, hn::Lt(low, high));
  if (hn::AllFalse(D(), cut)) return;
  const V per_length = one / select(cut, s1 - s0, one);
  for (const V& s : {low, high}) {
    const Vec3<V> on_a = a.corner[0] + u * s;
    const Vec3<V> on_b = b.corner[0] + v * ((s - s0) * per_length);
    writer.add(on_a, dot(pair.normal, on_a - on_b), cut);
  }
}

/// The common part of whatever faces whatever.
inline void cut_common(const NearPair& pair, const Side& a, const Side& b, M wanted, NearWriter& writer) {
  if (a.most < 2 || b.most < 2) return;
  const V two = set<V>(2.0);
  const auto a_line = hn::Eq(a.count, two);
  const auto b_line = hn::Eq(b.count, two);
  const auto area = hn::AndNot(b_line, wanted);
  if (!hn::AllFalse(D(), area)) cut_sides(pair, a, b, area, writer);
  const auto line = hn::And(wanted, b_line);
  if (hn::AllFalse(D(), line)) return;
  cut_line(pair, a, b, hn::AndNot(a_line, line), writer);
  cut_parallel_lines(pair, a, b, hn::And(line, a_line), writer);
}

}  // namespace prescene::simulation::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
