// SPDX-License-Identifier: Apache-2.0
// How contacts become rows: directions and responses, velocities to reach, what holds up what.
#if defined(PRESCENE_SIMULATION_IMPULSE_LOAD_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef PRESCENE_SIMULATION_IMPULSE_LOAD_INL_H_
#undef PRESCENE_SIMULATION_IMPULSE_LOAD_INL_H_
#else
#define PRESCENE_SIMULATION_IMPULSE_LOAD_INL_H_
#endif

#include <algorithm>

#include "impulse_rows-inl.h"
#include "lane_math-inl.h"
#include "lane_state.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::simulation::HWY_NAMESPACE {

template <bool kMany>
void ContactRows<kMany>::note_supports() {
  constexpr Real kSteep = Real(0.3);
  for (std::size_t i = 0; i < hn::Lanes(D()); ++i) {
    for (int index = 0; index < objects(); ++index) supports_[index][i] = 0;
    for (int index = 0; index < objects(); ++index) {
      const int at = state_.at(index, slots_[i]);
      for (int j = 0; j < state_.warm_count[static_cast<std::size_t>(at)]; ++j) {
        const WarmContact& warm = state_.warm(at)[j];
        const int body = scene_.parts[static_cast<std::size_t>(warm.part)].body;
        const bool object = body >= 0 && body < objects();
        if (warm.upward > kSteep) supports_[index][i] |= 1U << (object ? body : kMaxObjects);
        if (object && warm.upward < -kSteep) supports_[body][i] |= 1U << index;
      }
    }
  }
}

template <bool kMany>
V ContactRows<kMany>::held_up(int object_index, int but) const {
  HWY_ALIGN Real held[kLaneMultiple] = {};
  for (std::size_t i = 0; i < hn::Lanes(D()); ++i) {
    held[i] = (supports_[object_index][i] & ~(1U << but)) != 0 ? Real(1) : Real(0);
  }
  return hn::Load(D(), held);
}

template <bool kMany>
void ContactRows<kMany>::load_others(int row, Others& others) const {
  for (std::size_t i = 0; i < hn::Lanes(D()); ++i) {
    const LaneContact* c = contact(row, i);
    const int body = c ? scene_.parts[static_cast<std::size_t>(c->part)].body : -1;
    for (std::size_t k = 0; k < 3; ++k) {
      const int at = body >= 0 ? state_.at(body, slots_[i]) : 0;
      others.velocity[k][i] = body >= 0 ? state_.v[k][at] : Real(0);
      others.spin[k][i] = body >= 0 ? state_.w[k][at] : Real(0);
      others.origin[k][i] = body >= 0 ? state_.p[k][at] : Real(0);
    }
  }
}

template <bool kMany>
template <bool kPair>
void ContactRows<kMany>::load_row(const RowGroup& group, int row) {
  const D d;
  const V one = set<V>(1.0);
  HWY_ALIGN Real raw[13][kLaneMultiple];
  const Real arm = scene_.bodies[static_cast<std::size_t>(group.a)].rolling_arm;
  for (std::size_t i = 0; i < hn::Lanes(d); ++i) {
    if (const LaneContact* c = contact(row, i)) {
      const PartId& other = scene_.parts[static_cast<std::size_t>(c->part)];
      for (std::size_t j = 0; j < 3; ++j) {
        raw[j][i] = c->position[j];
        raw[3 + j][i] = c->normal[j];
      }
      raw[6][i] = c->gap;
      raw[7][i] = other.friction;
      raw[8][i] = other.impact_friction;
      raw[9][i] = other.restitution;
      raw[10][i] = std::max(other.rolling_arm, arm);
      raw[11][i] = static_cast<Real>(c->part);
      raw[12][i] = c->turning;
    } else {
      // Far off: never pressed.
      for (auto& values : raw) values[i] = 0;
      raw[5][i] = 1;
      raw[6][i] = Real(1e3);
      raw[11][i] = -1;
    }
  }
  const auto column = [&](std::size_t j) HWY_ATTR { return hn::Load(d, raw[j]); };
  const ObjectLanes& a = object(group.a);
  const Vec3<V> n{column(3), column(4), column(5)};
  // Arms end on the body's own surface, which will have met the other when the impulse acts. Of two that are free they
  // end midway, or the two would not keep their angular momentum.
  V to_surface = set<V>(0.5) * hn::Max(column(6), set<V>(0.0));
  if constexpr (kPair) {
    const V both_free = a.inverse_mass * object(group.b).inverse_mass;
    to_surface = hn::IfThenZeroElse(hn::Gt(both_free, set<V>(0.0)), to_surface);
  }
  const Vec3<V> midway{column(0), column(1), column(2)};
  const Vec3<V> r = midway + n * to_surface;
  const Vec3<V> on_other_W = a.R * (midway - n * to_surface);
  Vec3<V> t1, t2;
  basis(n, t1, t2);
  Vec3<V> r_b = set3<V>(0.0, 0.0, 0.0);
  if constexpr (kPair) {
    const ObjectLanes& b = object(group.b);
    r_b = transposed(b.R, on_other_W + (a.p - b.p));
    put3(row, kPosition, r_b);
  }
  const auto put_row = [&](int at, const Vec3<V>& direction, Vec3<V>& turn_a, Vec3<V>& turn_b) HWY_ATTR {
    const Vec3<V> direction_W = a.R * direction;
    turn_a = times(cross(r, direction), a.inverse_root);
    put3(row, at, direction_W);
    put3(row, at + 3, turn_a);
    if constexpr (kPair) {
      const ObjectLanes& b = object(group.b);
      turn_b = times(cross(r_b, transposed(b.R, direction_W)), b.inverse_root);
      put3(row, at + 6, turn_b);
    }
  };
  Vec3<V> turn_n, turn_1, turn_2, other_n, other_1, other_2;
  put_row(kNormal, n, turn_n, other_n);
  put_row(kTangent1, t1, turn_1, other_1);
  put_row(kTangent2, t2, turn_2, other_2);
  V response = per_mass(group.a, one + dot(turn_n, turn_n));
  V k11 = per_mass(group.a, one + dot(turn_1, turn_1));
  V k22 = per_mass(group.a, one + dot(turn_2, turn_2));
  V k12 = per_mass(group.a, dot(turn_1, turn_2));
  if constexpr (kPair) {
    response = response + per_mass(group.b, one + dot(other_n, other_n));
    k11 = k11 + per_mass(group.b, one + dot(other_1, other_1));
    k22 = k22 + per_mass(group.b, one + dot(other_2, other_2));
    k12 = k12 + per_mass(group.b, dot(other_1, other_2));
  }
  put(row, kResponse, response);
  put(row, kInverse, inverse_of(response));
  const V half = set<V>(0.5);
  const V difference = half * (k11 - k22);
  const V stiffest = half * (k11 + k22) + hn::Sqrt(difference * difference + k12 * k12);
  put(row, kPerSlipStep, stiffest);
  // Lanes without this contact have no slip: the least one, whose square is none, would pass the test of its size.
  put(row, kSlipStep, hn::IfThenElseZero(hn::Ge(column(11), set<V>(0.0)), inverse_of(stiffest)));
  put(row, kRollingArm, column(10));
  if (rolls()) put(row, kPerRollingStep, kPair ? softness(group.a) + softness(group.b) : softness(group.a));
  put3(row, kRolling, set3<V>(0.0, 0.0, 0.0));
  put(row, kPart, column(11));
  if constexpr (kPair) {
    const ObjectLanes& b = object(group.b);
    load_motion<kPair>(group, row, on_other_W, column(6), column(12), b.restitution, b.impact_friction, b.friction);
  } else {
    load_motion<kPair>(group, row, on_other_W, column(6), column(12), column(9), column(8), column(7));
  }
}

template <bool kMany>
template <bool kPair>
void ContactRows<kMany>::load_motion(const RowGroup& group, int row, const Vec3<V>& on_other_W, V gap, V turning,
                                     V other_restitution, V other_impact, V other_friction) {
  const D d;
  const V zero = set<V>(0.0);
  const V one = set<V>(1.0);
  const ObjectLanes& a = object(group.a);
  const ObjectLanes& b = object(kPair ? group.b : group.a);
  V speed_before = along<kPair>(axis<kPair>(row, kNormal), a.before, b.before) + turning;
  V speed = along<kPair>(axis<kPair>(row, kNormal), a.flown, b.flown);
  V base_1 = along<kPair>(axis<kPair>(row, kTangent1), a.flown, b.flown);
  V base_2 = along<kPair>(axis<kPair>(row, kTangent2), a.flown, b.flown);
  if constexpr (!kPair) {
    const Vec3<V> position = a.p + on_other_W;
    if (scene_.has_kinematic()) {
      // The surface that moves.
      Others others;
      load_others(row, others);
      const auto column = [&](const Real(&rows)[3][kLaneMultiple]) HWY_ATTR {
        return Vec3<V>{hn::Load(d, rows[0]), hn::Load(d, rows[1]), hn::Load(d, rows[2])};
      };
      const Vec3<V> spin = column(others.spin);
      const Vec3<V> from_origin = position - column(others.origin);
      const Vec3<V> velocity = column(others.velocity) + cross(spin, from_origin);
      const V rising = dot(get3(row, kNormal), velocity);
      speed = speed - rising;
      speed_before = speed_before - rising;
      base_1 = base_1 - dot(get3(row, kTangent1), velocity);
      base_2 = base_2 - dot(get3(row, kTangent2), velocity);
      put3(row, kSpin, transposed(a.R, spin));
      put3(row, kPosition, from_origin);
    } else {
      put3(row, kPosition, position);
    }
  }
  const V dt = set<V>(settings_.dt) * a.share;
  const V per_dt = set<V>(1.0 / settings_.dt) / a.share;
  put(row, kAtEnd, gap + dt * hn::Min(zero, speed_before));
  const V half = set<V>(0.5);
  const V along_gravity = dot(get3(row, kNormal), set3<V>(settings_.gravity));
  V falling = one;
  if constexpr (kMany) {
    falling = hn::IfThenElseZero(hn::Gt(a.inverse_mass, zero), one);
    put(row, kUpward, along_gravity * set<V>(-1.0 / std::max(settings_.gravity_size, 1e-30)));
    if constexpr (kPair) {
      // What else holds up one of the two does not fall with the other.
      falling = falling - hn::IfThenElseZero(hn::Gt(b.inverse_mass, zero), one);
      falling = falling + held_up(group.b, group.a) - held_up(group.a, group.b);
    }
  }
  const V acceleration = along_gravity * falling - turning * per_dt;
  const auto closes = hn::Lt(gap + dt * (speed_before + half * dt * acceleration), zero);
  const auto open = hn::Gt(gap, zero);
  const V close_by = hn::Neg(gap) * per_dt;
  const V resting = hn::IfThenElseZero(open, close_by);
  const auto hit = hn::And(closes, hn::Lt(speed_before, set<V>(-settings_.restitution_speed)));
  // The gap closes at hit_time with the speed it has then; what bounces goes on under gravity until the step ends. A
  // bounce that falls back within the step is none.
  const V hit_time = hn::IfThenElseZero(hn::And(hit, open), time_to_close(gap, speed_before, acceleration, dt));
  const V speed_at_hit = speed_before + acceleration * hit_time;
  const V bounce = hn::Max(zero, acceleration * (dt - hit_time) - a.restitution * other_restitution * speed_at_hit);
  const V bounced_to = select(hn::Gt(bounce, zero), bounce - half * dt * along_gravity * falling, zero);
  const V target = select(hit, bounced_to, resting);
  put(row, kTarget, target - speed);
  for (const int body : {group.a, kPair ? group.b : group.a}) {
    V& struck = objects_[body].struck;
    struck = select(hit, one, struck);
  }
  put(row, kHit, hn::IfThenElseZero(hit, one));
  put(row, kBounced, hn::IfThenElseZero(hn::And(hit, hn::Gt(bounce, zero)), one));
  put(row, kHitTime, hit_time);
  const V push = select(open, close_by, close_by * set<V>(settings_.overlap_recovery) * a.share);
  put(row, kPush, push);
  overlap_ = overlap_ || !hn::AllFalse(d, hn::Gt(push, set<V>(settings_.accuracy)));
  const auto impact = hn::And(closes, hn::Lt(speed_before, set<V>(-settings_.impact_speed)));
  put(row, kMu, select(impact, a.impact_friction * other_impact, a.friction * other_friction));
  put(row, kBase1, base_1);
  put(row, kBase2, base_2);
}

}  // namespace prescene::simulation::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
