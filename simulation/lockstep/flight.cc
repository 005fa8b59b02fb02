// SPDX-License-Identifier: Apache-2.0
// Free flight of all live instances, and which of their objects come near what.
#include <cmath>

#include "lane_state.h"
#include "prescene/simulation/rules/contact_rules.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "flight.cc"
#include <hwy/foreach_target.h>
// After foreach_target.h, which includes this file once for each instruction set.
#include <hwy/highway.h>

#include "lane_math-inl.h"
#include "lane_spin-inl.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::simulation::HWY_NAMESPACE {

using D = hn::CappedTag<Real, kLaneMultiple>;
using V = hn::Vec<D>;

HWY_INLINE Vec3<V> load(const Rows<3>& rows, int at) {
  const D d;
  return {hn::Load(d, rows[0] + at), hn::Load(d, rows[1] + at), hn::Load(d, rows[2] + at)};
}
HWY_INLINE Quat<V> load(const Rows<4>& rows, int at) {
  const D d;
  return {hn::Load(d, rows[0] + at), hn::Load(d, rows[1] + at), hn::Load(d, rows[2] + at), hn::Load(d, rows[3] + at)};
}
HWY_INLINE Mat3<V> load(const Rows<9>& rows, int at) {
  const D d;
  return {{hn::Load(d, rows[0] + at), hn::Load(d, rows[1] + at), hn::Load(d, rows[2] + at)},
          {hn::Load(d, rows[3] + at), hn::Load(d, rows[4] + at), hn::Load(d, rows[5] + at)},
          {hn::Load(d, rows[6] + at), hn::Load(d, rows[7] + at), hn::Load(d, rows[8] + at)}};
}
HWY_INLINE void store(const Vec3<V>& a, const Rows<3>& rows, int at) {
  const D d;
  hn::Store(a.x, d, rows[0] + at);
  hn::Store(a.y, d, rows[1] + at);
  hn::Store(a.z, d, rows[2] + at);
}
HWY_INLINE void store(const Quat<V>& a, const Rows<4>& rows, int at) {
  const D d;
  hn::Store(a.w, d, rows[0] + at);
  hn::Store(a.x, d, rows[1] + at);
  hn::Store(a.y, d, rows[2] + at);
  hn::Store(a.z, d, rows[3] + at);
}
HWY_INLINE void store(const Mat3<V>& m, const Rows<9>& rows, int at) {
  store(m.r0, Rows<3>{rows[0], rows[1], rows[2]}, at);
  store(m.r1, Rows<3>{rows[3], rows[4], rows[5]}, at);
  store(m.r2, Rows<3>{rows[6], rows[7], rows[8]}, at);
}

HWY_INLINE std::uint32_t bits_of_slots(std::span<const std::uint8_t> wanted, int slot) {
  const auto count = static_cast<int>(wanted.size());
  std::uint32_t bits = 0;
  for (int i = 0; i < static_cast<int>(hn::Lanes(D())) && slot + i < count; ++i) {
    bits |= static_cast<std::uint32_t>(wanted[static_cast<std::size_t>(slot + i)] != 0) << i;
  }
  return bits;
}

void fly_lanes(const LockstepScene* scene, int object, const std::span<const std::uint8_t>* wanted, LaneState* state) {
  const D d;
  const LaneBody& body = scene->bodies[static_cast<std::size_t>(object)];
  const Vec3<V> gravity = set3<V>(scene->settings.gravity);
  const V radius = set<V>(body.radius);
  const int first = state->at(object, 0);
  const auto count = static_cast<int>(wanted->size());
  for (int at = first; at < first + count; at += static_cast<int>(hn::Lanes(d))) {
    if (bits_of_slots(*wanted, at - first) == 0) continue;
    const V share = hn::Load(d, state->share + at);
    const V dt = set<V>(scene->settings.dt) * share;
    const V half_dt = set<V>(0.5 * scene->settings.dt) * share;
    const Vec3<V> p = load(state->p, at);
    const Vec3<V> v = load(state->v, at);
    const Vec3<V> w = load(state->w, at);
    const Quat<V> q = load(state->q, at);
    // A parabola, and a turn that keeps the angular momentum.
    const Vec3<V> begun_v = v + gravity * hn::Load(d, state->owed + at);
    const Vec3<V> flown_v = begun_v + gravity * dt;
    const Vec3<V> flown_p = p + (begun_v + flown_v) * half_dt;
    const Mat3<V> R = matrix_of(q);
    const Spin<V> flown = spun(body, Spin<V>{q, transposed(R, w)}, share);
    const Vec3<V> flown_w = rotated(flown.q, flown.w_P);
    store(flown_p, state->flown_p, at);
    store(flown_v, state->flown_v, at);
    store(flown_w, state->flown_w, at);
    store(flown.q, state->flown_q, at);
    store(R, state->R, at);
    const V speed = hn::Max(length(v), length(flown_v));
    const V spin = hn::Max(length(w), length(flown_w));
    hn::Store(dt * (speed + spin * (radius + length(load(state->com, at)))), d, state->travel + at);
  }
}

HWY_INLINE const ConvexPart& part_of(const LockstepScene& scene, const PartQuery& query) {
  return scene.bodies[static_cast<std::size_t>(query.object)].parts[static_cast<std::size_t>(query.part)];
}

void find_pairs_lanes(const LockstepScene* scene, const PartQuery* query, LaneState* state, LanePairs* pairs) {
  const D d;
  const ConvexPart& part = part_of(*scene, *query);
  const V zero = set<V>(0.0);
  const V ball = set<V>(part.ball);
  const auto lanes = static_cast<int>(hn::Lanes(d));
  for (int slot = 0; slot < static_cast<int>(query->wanted.size()); slot += lanes) {
    const std::uint32_t allowed = bits_of_slots(query->wanted, slot);
    if (allowed == 0) continue;
    const int at = state->at(query->object, slot);
    const Mat3<V> R = load(state->R, at);
    const Vec3<V> center = load(state->p, at) + R * (set3<V>(part.center) - load(state->com, at));
    const V range = hn::Load(d, state->travel + at) + set<V>(kContactMargin);
    const Vec3<V> half = abs(R) * set3<V>(part.box_half) + Vec3<V>{range, range, range};
    for (std::size_t f = 0; f < scene->fixed.size(); ++f) {
      const FixedPart& fixed = scene->fixed[f];
      const Vec3<V> apart = center - set3<V>(fixed.shape.center);
      const Vec3<V> reach = half + set3<V>(fixed.shape.box_half);
      const auto overlap = hn::And(hn::Le(hn::Abs(apart.x), reach.x),
                                   hn::And(hn::Le(hn::Abs(apart.y), reach.y), hn::Le(hn::Abs(apart.z), reach.z)));
      std::uint32_t near = bits_of(D(), overlap) & allowed;
      if (near == 0) continue;
      if (fixed.shape.kind != CoreKind::kBox) {
        for (int i = 0; i < lanes; ++i) {
          if (near >> i & 1U) pairs->shapes[f].push_back({at + i, static_cast<std::int32_t>(f)});
        }
        continue;
      }
      const Vec3<V> c = transposed(set_matrix<V>(fixed.shape.R_PS), apart);
      const Vec3<V> a{hn::Abs(c.x), hn::Abs(c.y), hn::Abs(c.z)};
      const Vec3<V> box = set3<V>(fixed.full_half);
      const Vec3<V> out{hn::Max(a.x - box.x, zero), hn::Max(a.y - box.y, zero), hn::Max(a.z - box.z, zero)};
      const V ball_reach = ball + range;
      const auto in_ball = hn::Le(dot(out, out), ball_reach * ball_reach);
      // Over the inner part of a face: whatever the object's turn, its nearest point is over the face, too.
      const auto inner_x = hn::Le(a.x + ball, box.x);
      const auto inner_y = hn::Le(a.y + ball, box.y);
      const auto inner_z = hn::Le(a.z + ball, box.z);
      const auto over_x = hn::And(hn::Ge(a.x, box.x), hn::And(inner_y, inner_z));
      const auto over_y = hn::And(hn::Ge(a.y, box.y), hn::And(inner_z, inner_x));
      const auto over_z = hn::And(hn::Ge(a.z, box.z), hn::And(inner_x, inner_y));
      near &= bits_of(D(), in_ball);
      if (near == 0) continue;
      const std::uint32_t over[3] = {bits_of(D(), over_x), bits_of(D(), over_y), bits_of(D(), over_z)};
      const std::uint32_t back[3] = {bits_of(D(), hn::Lt(c.x, zero)), bits_of(D(), hn::Lt(c.y, zero)),
                                     bits_of(D(), hn::Lt(c.z, zero))};
      for (int i = 0; i < lanes; ++i) {
        if (!(near >> i & 1U)) continue;
        int face = -1;
        for (int k = 0; k < 3; ++k) {
          if (over[k] >> i & 1U) face = 2 * k + static_cast<int>(back[k] >> i & 1U);
        }
        if (face >= 0) {
          pairs->planes.push_back({at + i, static_cast<std::int32_t>(6 * f) + face});
        } else {
          pairs->boxes.push_back({at + i, static_cast<std::int32_t>(f)});
        }
      }
    }
  }
}

void find_body_pairs_lanes(const LockstepScene* scene, const PartQuery* query, int body, LaneState* state,
                           LanePairs* pairs) {
  const D d;
  const ConvexPart& part = part_of(*scene, *query);
  const std::vector<ConvexPart>& others = scene->bodies[static_cast<std::size_t>(body)].parts;
  const auto first_part = static_cast<std::size_t>(scene->first_part[static_cast<std::size_t>(body)]);
  const auto lanes = static_cast<int>(hn::Lanes(d));
  for (int slot = 0; slot < static_cast<int>(query->wanted.size()); slot += lanes) {
    const std::uint32_t allowed = bits_of_slots(query->wanted, slot);
    if (allowed == 0) continue;
    const int at = state->at(query->object, slot);
    const int at_other = state->at(body, slot);
    const Mat3<V> R = load(state->R, at);
    const Vec3<V> center = load(state->p, at) + R * (set3<V>(part.center) - load(state->com, at));
    const V range = hn::Load(d, state->travel + at) + hn::Load(d, state->travel + at_other) + set<V>(kContactMargin);
    const Vec3<V> half = abs(R) * set3<V>(part.box_half) + Vec3<V>{range, range, range};
    const Mat3<V> R_other = load(state->R, at_other);
    const Vec3<V> p_other = load(state->p, at_other);
    const Vec3<V> com_other = load(state->com, at_other);
    for (std::size_t j = 0; j < others.size(); ++j) {
      const Vec3<V> apart = center - p_other - R_other * (set3<V>(others[j].center) - com_other);
      const Vec3<V> reach = half + abs(R_other) * set3<V>(others[j].box_half);
      const V ball = set<V>(part.ball + others[j].ball) + range;
      const auto overlap =
          hn::And(hn::Le(dot(apart, apart), ball * ball),
                  hn::And(hn::Le(hn::Abs(apart.x), reach.x),
                          hn::And(hn::Le(hn::Abs(apart.y), reach.y), hn::Le(hn::Abs(apart.z), reach.z))));
      const std::uint32_t near = bits_of(D(), overlap) & allowed;
      for (int i = 0; near >> i != 0; ++i) {
        if (near >> i & 1U) pairs->shapes[first_part + j].push_back({at + i, at_other + i});
      }
    }
  }
}

void measure_lanes(const LockstepScene* scene, int object, int count, LaneState* state) {
  const D d;
  const Vec3<V> moments = set3<V>(scene->bodies[static_cast<std::size_t>(object)].unit_moments);
  const Vec3<V> origin = set3<V>(scene->origin);
  const int first = state->at(object, 0);
  for (int at = first; at < first + count; at += static_cast<int>(hn::Lanes(d))) {
    const Vec3<V> v = load(state->v, at);
    const Vec3<V> w = load(state->w, at);
    const Vec3<V> w_P = transposed(matrix_of(load(state->q, at)), w);
    const Vec3<V> p = load(state->p, at) + origin;
    const V v2 = dot(v, v);
    const V half = set<V>(0.5);
    hn::Store(half * v2 + half * dot(w_P, times(moments, w_P)), d, state->energy + at);
    hn::Store(dot(p, p), d, state->distance2 + at);
    hn::Store(hn::Max(v2, dot(w, w)), d, state->speed2 + at);
  }
}

}  // namespace prescene::simulation::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace prescene::simulation {

HWY_EXPORT(fly_lanes);
HWY_EXPORT(find_pairs_lanes);
HWY_EXPORT(find_body_pairs_lanes);
HWY_EXPORT(measure_lanes);

void fly(const LockstepScene& scene, int object, std::span<const std::uint8_t> wanted, LaneState& state) {
  HWY_DYNAMIC_DISPATCH(fly_lanes)(&scene, object, &wanted, &state);
}

void find_pairs(const LockstepScene& scene, const PartQuery& query, LaneState& state, LanePairs& pairs) {
  HWY_DYNAMIC_DISPATCH(find_pairs_lanes)(&scene, &query, &state, &pairs);
}

void find_body_pairs(const LockstepScene& scene, const PartQuery& query, int body, LaneState& state, LanePairs& pairs) {
  HWY_DYNAMIC_DISPATCH(find_body_pairs_lanes)(&scene, &query, body, &state, &pairs);
}

void measure(const LockstepScene& scene, int object, int count, LaneState& state) {
  HWY_DYNAMIC_DISPATCH(measure_lanes)(&scene, object, count, &state);
}

void land(std::span<const std::int32_t> objects, LaneState& state) {
  for (const std::int32_t at : objects) {
    for (std::size_t i = 0; i < 3; ++i) {
      state.p[i][at] = state.flown_p[i][at];
      state.v[i][at] = state.flown_v[i][at];
      state.w[i][at] = state.flown_w[i][at];
    }
    for (std::size_t i = 0; i < 4; ++i) state.q[i][at] = state.flown_q[i][at];
    state.lag[at] = state.owed[at] = Real(0);
  }
}

}  // namespace prescene::simulation
#endif
