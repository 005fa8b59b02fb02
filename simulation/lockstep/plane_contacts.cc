// SPDX-License-Identifier: Apache-2.0
// Contacts of an object with faces that it is over the inner part of: there the nearest point is the lowest one and
// the normal the face's, whatever else the fixed part has.
#include <algorithm>
#include <cmath>

#include "lane_state.h"
#include "prescene/simulation/rules/contact_rules.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "plane_contacts.cc"
#include <hwy/foreach_target.h>
// After foreach_target.h, which includes this file once for each instruction set.
#include <hwy/highway.h>

#include "lane_math-inl.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::simulation::HWY_NAMESPACE {

using D = hn::CappedTag<Real, kLaneMultiple>;
using V = hn::Vec<D>;

/// What a vector of pairs needs of its objects.
struct PlaneLanes {
  HWY_ALIGN Real R[9][kLaneMultiple];
  HWY_ALIGN Real p[3][kLaneMultiple];
  HWY_ALIGN Real com[3][kLaneMultiple];
  HWY_ALIGN Real normal[3][kLaneMultiple];
  HWY_ALIGN Real offset[kLaneMultiple];
  HWY_ALIGN Real range[kLaneMultiple];
  std::int32_t object[kLaneMultiple];
  std::int32_t part[kLaneMultiple];
};

/// Appends points to the contacts of their objects.
class PlaneWriter {
 public:
  PlaneWriter(const PlaneLanes& lanes, std::uint32_t valid, const Vec3<V>& normal, V range, V radius,
              ContactStage& stage)
      : lanes_(lanes), valid_(valid), normal_(normal), range_(range), radius_(radius), stage_(stage) {
    const D d;
    hn::Store(normal.x, d, stored_normal_[0]);
    hn::Store(normal.y, d, stored_normal_[1]);
    hn::Store(normal.z, d, stored_normal_[2]);
  }

  /// `core`: points of the core from the centre of mass, P; `height`: theirs above the plane.
  void add(const Vec3<V>& core, V height, hn::Mask<D> mask) {
    const D d;
    const V gap = height - radius_;
    std::uint8_t bytes[8] = {};
    hn::StoreMaskBits(d, hn::And(mask, hn::Le(gap, range_)), bytes);
    std::uint32_t bits = (bytes[0] | static_cast<std::uint32_t>(bytes[1]) << 8) & valid_;
    if (bits == 0) return;
    const Vec3<V> middle = core - normal_ * (radius_ + set<V>(0.5) * gap);
    HWY_ALIGN Real x[kLaneMultiple], y[kLaneMultiple], z[kLaneMultiple], g[kLaneMultiple];
    hn::Store(middle.x, d, x);
    hn::Store(middle.y, d, y);
    hn::Store(middle.z, d, z);
    hn::Store(gap, d, g);
    for (int i = 0; bits != 0; ++i, bits >>= 1) {
      if (!(bits & 1U)) continue;
      stage_.add(i, {{x[i], y[i], z[i]},
                     {stored_normal_[0][i], stored_normal_[1][i], stored_normal_[2][i]},
                     g[i],
                     lanes_.part[i],
                     0,
                     0,
                     0});
    }
  }

 private:
  const PlaneLanes& lanes_;
  std::uint32_t valid_;
  Vec3<V> normal_;
  V range_, radius_;
  ContactStage& stage_;
  HWY_ALIGN Real stored_normal_[3][kLaneMultiple];
};

HWY_INLINE hn::Mask<D> all_lanes() { return hn::Eq(set<V>(0.0), set<V>(0.0)); }

/// The corners of the side that faces the plane; n in S. Core points from the part's middle, S.
template <class Add>
HWY_INLINE void box_corners(const ConvexPart& part, const Vec3<V>& n, const Add& add) {
  const V zero = set<V>(0.0);
  const Vec3<V> a{hn::Abs(n.x), hn::Abs(n.y), hn::Abs(n.z)};
  const auto x_side = hn::And(hn::Ge(a.x, a.y), hn::Ge(a.x, a.z));
  const auto y_side = hn::AndNot(x_side, hn::Ge(a.y, a.z));
  const Vec3<V> half = set3<V>(part.half);
  // The plane is below: towards -n.
  const Vec3<V> facing{select(hn::Gt(n.x, zero), hn::Neg(half.x), half.x),
                       select(hn::Gt(n.y, zero), hn::Neg(half.y), half.y),
                       select(hn::Gt(n.z, zero), hn::Neg(half.z), half.z)};
  const auto z_side = hn::Not(hn::Or(x_side, y_side));
  for (int i = 0; i < 4; ++i) {
    const bool u = i == 1 || i == 2;
    const bool v = i >= 2;
    const Vec3<V> first{u ? half.x : hn::Neg(half.x), u ? half.y : hn::Neg(half.y), zero};
    const Vec3<V> second{zero, v ? half.y : hn::Neg(half.y), v ? half.z : hn::Neg(half.z)};
    // Around x: (y, z); around y: (x, z); around z: (x, y).
    add(Vec3<V>{select(x_side, facing.x, first.x), select(y_side, facing.y, select(x_side, first.y, second.y)),
                select(z_side, facing.z, second.z)},
        all_lanes());
  }
}

/// The lower rim where the axis is steep, the lower line where it is flat; n in S.
template <class Add>
HWY_INLINE void cylinder_points(const ConvexPart& part, const Vec3<V>& n, const Add& add) {
  const V zero = set<V>(0.0);
  const V one = set<V>(1.0);
  const V s = hn::Sqrt(n.x * n.x + n.y * n.y);
  const auto tilted = hn::Gt(s, set<V>(kFlatCap));
  const V scale = one / select(tilted, s, one);
  const V cx = select(tilted, hn::Neg(n.x * scale), one);
  const V cy = select(tilted, hn::Neg(n.y * scale), zero);
  const auto rim = hn::Gt(hn::Abs(n.z), s);
  const V r = set<V>(part.half[0]);
  const V top = set<V>(part.half[2]);
  const V low = select(hn::Gt(n.z, zero), hn::Neg(top), top);
  for (int k = 0; k < kRimPoints; ++k) {
    const V c = set<V>(kRimCosine[k]);
    const V t = set<V>(kRimSine[k]);
    const Vec3<V> on_rim{r * (cx * c - cy * t), r * (cx * t + cy * c), low};
    if (k < 2) {
      const Vec3<V> on_side{r * cx, r * cy, k == 0 ? hn::Neg(top) : top};
      add(select(rim, on_rim, on_side), all_lanes());
    } else {
      add(on_rim, rim);
    }
  }
}

/// The base where it faces the plane more than the side, else the line up the side; n in S.
template <class Add>
HWY_INLINE void cone_points(const ConvexPart& part, const Vec3<V>& n, const Add& add) {
  const V zero = set<V>(0.0);
  const V one = set<V>(1.0);
  const V s = hn::Sqrt(n.x * n.x + n.y * n.y);
  const auto tilted = hn::Gt(s, set<V>(kFlatCap));
  const V scale = one / select(tilted, s, one);
  const V cx = select(tilted, hn::Neg(n.x * scale), one);
  const V cy = select(tilted, hn::Neg(n.y * scale), zero);
  const double height = part.half[1] - part.half[2];
  const double slant = std::sqrt(part.half[0] * part.half[0] + height * height);
  const auto rim = hn::Ge(n.z, s * set<V>(height / slant) - n.z * set<V>(part.half[0] / slant));
  const V r = set<V>(part.half[0]);
  const V base = set<V>(part.half[2]);
  for (int k = 0; k < kRimPoints; ++k) {
    const V c = set<V>(kRimCosine[k]);
    const V t = set<V>(kRimSine[k]);
    const Vec3<V> on_rim{r * (cx * c - cy * t), r * (cx * t + cy * c), base};
    if (k == 0) {
      add(on_rim, all_lanes());
    } else if (k == 1) {
      add(select(rim, on_rim, Vec3<V>{zero, zero, set<V>(part.half[1])}), all_lanes());
    } else {
      add(on_rim, rim);
    }
  }
}

/// The corners of the side that faces the plane most, and the lowest corner where it is not one of them.
template <class Add>
HWY_INLINE void hull_corners(const ConvexPart& part, const Vec3<V>& n, const Add& add) {
  const D d;
  V best = set<V>(-2.0);
  V best_face = set<V>(0.0);
  for (std::size_t f = 0; f < part.normals.size(); ++f) {
    const V along = hn::Neg(dot(set3<V>(part.normals[f]), n));
    const auto better = hn::Gt(along, best);
    best = select(better, along, best);
    best_face = select(better, set<V>(static_cast<double>(f)), best_face);
  }
  HWY_ALIGN Real faces[kLaneMultiple];
  hn::Store(best_face, d, faces);
  V lowest = set<V>(1e30);
  for (int k = 0; k < part.longest_loop; ++k) {
    HWY_ALIGN Real x[kLaneMultiple], y[kLaneMultiple], z[kLaneMultiple], more[kLaneMultiple];
    for (std::size_t i = 0; i < hn::Lanes(d); ++i) {
      const auto face = static_cast<std::size_t>(faces[i]);
      const std::array<double, 3>& corner = part.face_corners[face * kMaxLoop + static_cast<std::size_t>(k)];
      x[i] = static_cast<Real>(corner[0]);
      y[i] = static_cast<Real>(corner[1]);
      z[i] = static_cast<Real>(corner[2]);
      more[i] = k < part.corner_counts[face] ? Real(1) : Real(0);
    }
    const Vec3<V> corner{hn::Load(d, x), hn::Load(d, y), hn::Load(d, z)};
    lowest = hn::Min(lowest, dot(corner, n));
    add(corner, hn::Gt(hn::Load(d, more), set<V>(0.0)));
  }
  V deepest = set<V>(1e30);
  Vec3<V> point = set3<V>(0.0, 0.0, 0.0);
  for (const std::array<double, 3>& vertex : part.vertices) {
    const Vec3<V> corner = set3<V>(vertex);
    const V height = dot(corner, n);
    const auto lower = hn::Lt(height, deepest);
    deepest = select(lower, height, deepest);
    point = select(lower, corner, point);
  }
  add(point, hn::Lt(deepest, lowest - set<V>(1e-6)));
}

void touch_planes_lanes(const LockstepScene* scene, const ConvexPart* given, const LanePairs::Plane* pairs,
                        std::size_t count, LaneState* state) {
  const D d;
  const ConvexPart& part = *given;
  const std::size_t width = hn::Lanes(d);
  const Mat3<V> R_PS = set_matrix<V>(part.R_PS);
  const V radius = set<V>(part.radius);
  PlaneLanes lanes;
  ContactStage stage;
  for (std::size_t begin = 0; begin < count; begin += width) {
    const std::size_t filled = std::min(width, count - begin);
    for (std::size_t i = 0; i < width; ++i) {
      const LanePairs::Plane& pair = pairs[begin + std::min(i, filled - 1)];
      const FixedPlane& plane = scene->planes[static_cast<std::size_t>(pair.plane)];
      const std::int32_t object = pair.object;
      for (std::size_t k = 0; k < 9; ++k) lanes.R[k][i] = state->R[k][object];
      for (std::size_t k = 0; k < 3; ++k) {
        lanes.p[k][i] = state->p[k][object];
        lanes.com[k][i] = state->com[k][object];
        lanes.normal[k][i] = plane.normal[k];
      }
      lanes.offset[i] = plane.offset;
      lanes.range[i] = state->travel[object] + static_cast<Real>(kContactMargin);
      lanes.object[i] = object;
      lanes.part[i] = plane.part;
    }
    const auto column = [&](const Real(&rows)[3][kLaneMultiple]) HWY_ATTR {
      return Vec3<V>{hn::Load(d, rows[0]), hn::Load(d, rows[1]), hn::Load(d, rows[2])};
    };
    const Mat3<V> R{{hn::Load(d, lanes.R[0]), hn::Load(d, lanes.R[1]), hn::Load(d, lanes.R[2])},
                    {hn::Load(d, lanes.R[3]), hn::Load(d, lanes.R[4]), hn::Load(d, lanes.R[5])},
                    {hn::Load(d, lanes.R[6]), hn::Load(d, lanes.R[7]), hn::Load(d, lanes.R[8])}};
    const Vec3<V> n_W = column(lanes.normal);
    const Vec3<V> n = transposed(R, n_W);
    const V height = dot(n_W, column(lanes.p)) - hn::Load(d, lanes.offset);
    const Vec3<V> middle = set3<V>(part.center) - column(lanes.com);
    const std::uint32_t valid = (1U << filled) - 1U;
    PlaneWriter writer(lanes, valid, n, hn::Load(d, lanes.range), radius, stage);
    const Vec3<V> n_S = transposed(R_PS, n);
    const auto add = [&](const Vec3<V>& core, hn::Mask<D> mask) HWY_ATTR {
      const Vec3<V> point = middle + R_PS * core;
      writer.add(point, height + dot(n, point), mask);
    };
    switch (part.kind) {
      case CoreKind::kPoint:
        writer.add(middle, height + dot(n, middle), all_lanes());
        break;
      case CoreKind::kSegment:
        add(set3<V>(0.0, 0.0, -part.half[2]), all_lanes());
        add(set3<V>(0.0, 0.0, part.half[2]), all_lanes());
        break;
      case CoreKind::kBox:
        box_corners(part, n_S, add);
        break;
      case CoreKind::kCylinder:
        cylinder_points(part, n_S, add);
        break;
      case CoreKind::kCone:
        cone_points(part, n_S, add);
        break;
      case CoreKind::kHull:
        hull_corners(part, n_S, add);
        break;
      case CoreKind::kSpheres:  // no core
        break;
    }
    stage.flush(lanes.object, *state);
  }
}

}  // namespace prescene::simulation::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace prescene::simulation {

HWY_EXPORT(touch_planes_lanes);

void touch_planes(const LockstepScene& scene, const ConvexPart& part, std::span<const LanePairs::Plane> pairs,
                  LaneState& state) {
  if (pairs.empty()) return;
  HWY_DYNAMIC_DISPATCH(touch_planes_lanes)(&scene, &part, pairs.data(), pairs.size(), &state);
}

}  // namespace prescene::simulation
#endif
