// SPDX-License-Identifier: Apache-2.0
// Sequential impulses in lanes, in rounds of lanes that have not settled, and the poses that come of them.
#include <iterator>

#include "lane_state.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "impulses.cc"
#include <hwy/foreach_target.h>
// After foreach_target.h, which includes this file once for each instruction set.
#include <hwy/highway.h>

#include "impulse_iterations-inl.h"
#include "impulse_load-inl.h"
#include "impulse_rows-inl.h"
#include "impulse_warm_start-inl.h"
#include "lane_math-inl.h"
#include "lane_spin-inl.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::simulation::HWY_NAMESPACE {

constexpr int kKeptFields[] = {kImpulse, kSlip1, kSlip2, kRolling, kRolling + 1, kRolling + 2};

// Most lanes settle within a few iterations and one in thirty takes all of them. After each of these many iterations
// the lanes that have not settled are gathered into new vectors.
constexpr int kRounds[] = {8, 20};

template <bool kMany>
void LaneSolver<kMany>::keep(std::uint32_t lanes) {
  const D d;
  Real* kept[kLaneMultiple] = {};
  for (std::size_t i = 0; i < rows_.filled(); ++i) kept[i] = scratch_.kept(rows_.slot(i));
  for (int object = 0; object < rows_.objects(); ++object) {
    const Rates& change = changes_[object];
    for (const V& rate :
         {change.velocity.x, change.velocity.y, change.velocity.z, change.spin.x, change.spin.y, change.spin.z}) {
      HWY_ALIGN Real values[kLaneMultiple] = {};
      hn::Store(rate, d, values);
      for (std::size_t i = 0; i < rows_.filled(); ++i) *kept[i]++ = values[i];
    }
  }
  for (int k = 0; k < rows_.row_count(); ++k) {
    for (std::size_t i = 0; i < rows_.filled(); ++i) {
      if (!(lanes >> i & 1U) || !rows_.contact(k, i)) continue;
      for (const int f : kKeptFields) *kept[i]++ = rows_.field(k, f)[i];
    }
  }
}

template <bool kMany>
void LaneSolver<kMany>::resume() {
  const D d;
  const std::size_t width = hn::Lanes(d);
  const Real* kept[kLaneMultiple] = {};
  for (std::size_t i = 0; i < width; ++i) kept[i] = scratch_.kept(rows_.slot(i));
  for (int object = 0; object < rows_.objects(); ++object) {
    Rates& change = changes_[object];
    for (V* rate :
         {&change.velocity.x, &change.velocity.y, &change.velocity.z, &change.spin.x, &change.spin.y, &change.spin.z}) {
      HWY_ALIGN Real values[kLaneMultiple] = {};
      for (std::size_t i = 0; i < width; ++i) values[i] = *kept[i]++;
      *rate = hn::Load(d, values);
    }
  }
  for (int k = 0; k < rows_.row_count(); ++k) {
    for (std::size_t i = 0; i < width; ++i) {
      const bool there = rows_.contact(k, i) != nullptr;
      for (const int f : kKeptFields) rows_.field(k, f)[i] = there ? *kept[i]++ : Real(0);
    }
  }
}

template <bool kMany>
void LaneSolver<kMany>::finish(int object) {
  const V zero = set<V>(0.0);
  const ObjectLanes& o = rows_.object(object);
  const V dt = set<V>(settings_.dt) * o.share;
  const V half = set<V>(0.5);
  auto touched = hn::Lt(zero, zero);
  auto supported = touched;
  auto bounced = touched;
  auto any_hit = touched;
  V hit_time = dt;
  for (const RowGroup& group : rows_.groups()) {
    if (group.a != object && group.b != object) continue;
    for (int k = group.first; k < group.first + group.count; ++k) {
      const auto pressed = hn::Gt(rows_.get(k, kImpulse), zero);
      const auto hit = hn::Gt(rows_.get(k, kHit), zero);
      touched = hn::Or(touched, pressed);
      supported = hn::Or(supported, hn::AndNot(hit, pressed));
      bounced = hn::Or(bounced, hn::And(pressed, hn::Gt(rows_.get(k, kBounced), zero)));
      const auto lands = hn::And(pressed, hit);
      any_hit = hn::Or(any_hit, lands);
      hit_time = select(lands, hn::Min(hit_time, rows_.get(k, kHitTime)), hit_time);
    }
  }
  // What is held goes its way.
  if constexpr (kMany) touched = hn::And(touched, hn::Gt(o.inverse_mass, zero));
  const V before = hn::IfThenElseZero(any_hit, hit_time);
  const V after = dt - before;
  const Vec3<V> gravity = set3<V>(settings_.gravity);
  const auto flies_on = hn::Or(hn::Not(touched), hn::AndNot(supported, bounced));
  const V falls_before = hn::IfThenElseZero(hn::Not(supported), o.owed + half * before);
  const V falls_after = hn::IfThenElseZero(flies_on, hn::Neg(half * after));
  const Rates& change = changes_[object];
  const Rates& push = pushes_[object];
  // What bears it goes on as it did since the middle of the step before. After a hit that is not known.
  const Vec3<V> middle_v = o.flown.velocity + change.velocity;
  const V lag = hn::IfThenZeroElse(flies_on, half * dt);
  const V on = hn::IfThenZeroElse(hn::Or(flies_on, any_hit), lag * inverse_of(o.pulled));
  const Vec3<V> reacting_v = middle_v + gravity * hn::IfThenElseZero(flies_on, o.falls);
  const Vec3<V> ahead_v = reacting_v + (change.velocity + gravity * o.pulled) * on;
  const Vec3<V> push_v = push.velocity * dt;

  const Vec3<V> touched_p =
      o.p + (o.before.velocity + gravity * falls_before) * before + (reacting_v + gravity * falls_after) * after;
  const Vec3<V> new_p = select(touched, touched_p, rows_.lanes_of(state_.flown_p, object)) + push_v;
  // Not touched, it has the spin that it flew with.
  const Vec3<V> change_w = times(change.spin, o.inverse_root);
  const Spin<V> begun{rows_.lanes_of(state_.q, object), times(o.flown.spin, o.inverse_root) + change_w};
  const Spin<V> reacting = spun(*o.body, begun, o.share);
  const Quat<V> flown_q = rows_.lanes_of(state_.flown_q, object);
  const Vec3<V> flown_w = rows_.lanes_of(state_.flown_w, object);
  const Spin<V> ahead{select(touched, reacting.q, flown_q),
                      select(touched, reacting.w_P, rotated(conjugate(flown_q), flown_w))};
  // Until the hit it turned with the spin of before.
  const Vec3<V> turn = times(push.spin, o.inverse_root) * dt - change_w * hn::IfThenElseZero(touched, before);
  const Spin<V> spin = turned(*o.body, ahead, rotated(conjugate(ahead.q), o.R * turn));
  const Quat<V>& new_q = spin.q;
  const auto left_alone = hn::AndNot(touched, hn::Eq(dot(turn, turn), zero));
  const Vec3<V> middle_w = select(left_alone, flown_w, rotated(new_q, spin.w_P));
  const Vec3<V> new_v = select(touched, ahead_v, o.falling);
  const Vec3<V> new_w = select(touched, middle_w + o.R * change_w * on, middle_w);
  set_lanes(new_v, state_.v, object);
  set_lanes(new_w, state_.w, object);
  set_lanes(middle_v, state_.middle_v, object);
  set_lanes(middle_w, state_.middle_w, object);
  set_lanes(lag, state_.lag, object);
  set_lanes(hn::IfThenElseZero(any_hit, lag), state_.owed, object);
  set_lanes(new_p, state_.p, object);
  set_lanes(new_q.w, state_.q[0], object);
  set_lanes(new_q.x, state_.q[1], object);
  set_lanes(new_q.y, state_.q[2], object);
  set_lanes(new_q.z, state_.q[3], object);
  for (std::size_t i = 0; i < rows_.filled(); ++i) {
    if (ends_ >> i & 1U) state_.warm_count[static_cast<std::size_t>(state_.at(object, rows_.slot(i)))] = 0;
  }
}

template <bool kMany>
void LaneSolver<kMany>::note_impulses() {
  for (const RowGroup& group : rows_.groups()) {
    for (int k = group.first; k < group.first + group.count; ++k) {
      const Vec3<V> slip =
          rows_.get3(k, kTangent1) * rows_.get(k, kSlip1) + rows_.get3(k, kTangent2) * rows_.get(k, kSlip2);
      rows_.put3(k, kTangent1, slip);
      for (std::size_t i = 0; i < rows_.filled(); ++i) {
        LaneContact* c = rows_.contact(k, i);
        if (!(ends_ >> i & 1U) || !c) continue;
        c->impulse = rows_.field(k, kImpulse)[i];
        c->hit = c->impulse > 0 && rows_.field(k, kHit)[i] > 0 ? 1 : 0;
        if (c->impulse <= 0 || c->hit != 0) continue;
        const int at = state_.at(group.a, rows_.slot(i));
        WarmContact& warm = state_.warm(at)[state_.warm_count[static_cast<std::size_t>(at)]++];
        for (int j = 0; j < 3; ++j) {
          warm.position[j] = rows_.field(k, kPosition + j)[i];
          warm.friction[j] = rows_.field(k, kTangent1 + j)[i];
        }
        warm.impulse = c->impulse;
        warm.upward = kMany ? rows_.field(k, kUpward)[i] : Real(0);
        warm.part = c->part;
      }
    }
  }
}

template <bool kMany>
void LaneSolver<kMany>::run(std::span<const std::int32_t> slots, int first, int last,
                            std::vector<std::int32_t>& unsettled) {
  rows_.load(slots);
  for (Rates& change : changes_) change = no_rates();
  if (first == 0) {
    rows_.warm_start(changes_);
  } else {
    resume();
  }
  const std::uint32_t all = (1U << rows_.filled()) - 1U;
  std::uint32_t left = iterate(first, last) & all;
  if (last == settings_.iterations) left = 0;
  if (left != 0) {
    keep(left);
    for (std::size_t i = 0; i < rows_.filled(); ++i) {
      if (left >> i & 1U) unsettled.push_back(rows_.slot(i));
    }
  }
  ends_ = all & ~left;
  if (ends_ == 0) return;
  for (Rates& push : pushes_) push = no_rates();
  if (rows_.overlap()) push_out();
  for (int object = 0; object < rows_.objects(); ++object) finish(object);
  note_impulses();
}

template <bool kMany>
void solve_all(const LockstepScene& scene, std::span<const std::int32_t> slots, LaneState& state,
               SolverScratch& scratch) {
  const std::size_t width = hn::Lanes(D());
  LaneSolver<kMany> solver(scene, state, scratch);
  std::span<const std::int32_t> now = slots;
  int first = 0;
  for (std::size_t round = 0; !now.empty(); ++round) {
    const int iterations = scene.settings.iterations;
    const int last = round < std::size(kRounds) ? std::min(kRounds[round], iterations) : iterations;
    std::vector<std::int32_t>& next = scratch.unsettled(static_cast<int>(round % 2));
    next.clear();
    for (std::size_t begin = 0; begin < now.size(); begin += width) {
      solver.run(now.subspan(begin, std::min(width, now.size() - begin)), first, last, next);
    }
    now = next;
    first = last;
  }
}

void solve_lanes(const LockstepScene* scene, const std::int32_t* slots, std::size_t count, LaneState* state,
                 SolverScratch* scratch) {
  if (scene->objects == 1) {
    solve_all<false>(*scene, {slots, count}, *state, *scratch);
  } else {
    solve_all<true>(*scene, {slots, count}, *state, *scratch);
  }
}

}  // namespace prescene::simulation::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace prescene::simulation {

HWY_EXPORT(solve_lanes);

void solve(const LockstepScene& scene, std::span<const std::int32_t> slots, LaneState& state, SolverScratch& scratch) {
  if (slots.empty()) return;
  HWY_DYNAMIC_DISPATCH(solve_lanes)(&scene, slots.data(), slots.size(), &state, &scratch);
}

}  // namespace prescene::simulation
#endif
