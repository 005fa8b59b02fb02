// SPDX-License-Identifier: Apache-2.0
// Sequential impulses in lanes: the method of Bullet's stepper (simulation/bullet/contact_solver.h), and the poses that
// come of them.
#include <iterator>
#include <type_traits>

#include "lane_state.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "impulses.cc"
#include <hwy/foreach_target.h>
// After foreach_target.h, which includes this file once for each instruction set.
#include <hwy/highway.h>

#include "impulse_load-inl.h"
#include "impulse_rows-inl.h"
#include "lane_math-inl.h"
#include "lane_spin-inl.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::simulation::HWY_NAMESPACE {

constexpr int kKeptFields[] = {kImpulse, kSlip1, kSlip2, kRolling, kRolling + 1, kRolling + 2};

// Most lanes settle within a few iterations and one in thirty takes all of them. After each of these many iterations
// the lanes that have not settled are gathered into new vectors.
constexpr int kRounds[] = {8, 20};

template <bool kMany>
class LaneSolver {
 public:
  LaneSolver(const LockstepScene& scene, LaneState& state, SolverScratch& scratch)
      : settings_(scene.settings), state_(state), scratch_(scratch), rows_(scene, state, scratch) {}

  /// Iterations [first, last) of a vector of slots. Those that are settled, or all if last is the last one at all, end
  /// their step; the others are kept for the next round and appended to `unsettled`.
  void run(std::span<const std::int32_t> slots, int first, int last, std::vector<std::int32_t>& unsettled);

 private:
  static constexpr int kObjects = ContactRows<kMany>::kObjects;

  void set_lanes(V value, Real* row, int object) const {
    HWY_ALIGN Real values[kLaneMultiple] = {};
    hn::Store(value, D(), values);
    Real* of_object = row + state_.at(object, 0);
    for (std::size_t i = 0; i < rows_.filled(); ++i) {
      if (ends_ >> i & 1U) of_object[rows_.slot(i)] = values[i];
    }
  }
  void set_lanes(const Vec3<V>& value, const Rows<3>& rows, int object) const {
    set_lanes(value.x, rows[0], object);
    set_lanes(value.y, rows[1], object);
    set_lanes(value.z, rows[2], object);
  }

  /// Returns a bit for each lane that has not settled.
  std::uint32_t iterate(int first, int last);
  template <bool kPair>
  V solve_group(const RowGroup& group, M active, Rates& a, Rates& b);
  template <bool kPair>
  V solve_rolling(const RowGroup& group, int row, V impulse, M active, Rates& a, Rates& b);
  template <bool kPair>
  V push_group(const RowGroup& group, M active, Rates& a, Rates& b);
  void keep(std::uint32_t lanes);
  void resume();
  void push_out();
  void finish(int object);
  void note_impulses();

  /// Calls `step` with the group's rates, whether another object takes part being known.
  template <class Step>
  HWY_INLINE void with_rates(const RowGroup& group, Rates* rates, const Step& step) {
    // Copies that no store can change.
    Rates a = rates[group.a];
    if (kMany && group.b >= 0) {
      Rates b = rates[group.b];
      step(std::bool_constant<kMany>(), a, b);
      rates[group.b] = b;
    } else {
      Rates none = no_rates();
      step(std::false_type(), a, none);
    }
    rates[group.a] = a;
  }

  const StepSettings& settings_;
  LaneState& state_;
  SolverScratch& scratch_;
  ContactRows<kMany> rows_;
  std::uint32_t ends_ = 0;  // lanes whose step ends
  Rates changes_[kObjects];
  Rates pushes_[kObjects];
};

template <bool kMany>
template <bool kPair>
HWY_INLINE V LaneSolver<kMany>::solve_rolling(const RowGroup& group, int row, V impulse, M active, Rates& a, Rates& b) {
  // In spins that are not scaled: impulse I^-1/2 goes into the scaled one.
  const V zero = set<V>(0.0);
  const V one = set<V>(1.0);
  const V arm = rows_.get(row, kRollingArm);
  const V per_step = rows_.get(row, kPerRollingStep);
  const ObjectLanes& oa = rows_.object(group.a);
  const ObjectLanes& ob = rows_.object(kPair ? group.b : group.a);
  const Vec3<V> old = rows_.get3(row, kRolling);
  Vec3<V> spin = times(oa.flown.spin + a.spin, oa.inverse_root);
  if constexpr (kPair) {
    spin = oa.R * spin - ob.R * times(ob.flown.spin + b.spin, ob.inverse_root);
  } else if (rows_.has_spins()) {
    spin = spin - rows_.get3(row, kSpin);
  }
  Vec3<V> roll = old - spin * inverse_of(per_step);
  const V limit = arm * impulse;
  const V size = length(roll);
  const auto large = hn::Gt(size, limit);
  roll = roll * select(large, limit / select(large, size, one), one);
  roll = select(hn::And(active, hn::Gt(arm, zero)), roll, old);
  const Vec3<V> change = roll - old;
  rows_.put3(row, kRolling, roll);
  const V on_a = rows_.per_mass(group.a, one);
  if constexpr (kPair) {
    a.spin = a.spin + times(transposed(oa.R, change), oa.inverse_root) * on_a;
    b.spin = b.spin - times(transposed(ob.R, change), ob.inverse_root) * rows_.per_mass(group.b, one);
  } else {
    a.spin = a.spin + times(change, oa.inverse_root) * on_a;
  }
  return length(change) * per_step * arm;
}

template <bool kMany>
template <bool kPair>
HWY_INLINE V LaneSolver<kMany>::solve_group(const RowGroup& group, M active, Rates& a, Rates& b) {
  const V zero = set<V>(0.0);
  const V one = set<V>(1.0);
  const bool rolls = rows_.rolls();
  V largest = zero;
  for (int k = group.first; k < group.first + group.count; ++k) {
    // Normal.
    const V old = rows_.get(k, kImpulse);
    const Axis normal = rows_.template axis<kPair>(k, kNormal);
    const V speed = rows_.template along<kPair>(normal, a, b);
    const V wanted = hn::Max(zero, old + (rows_.get(k, kTarget) - speed) * rows_.get(k, kInverse));
    const V impulse = select(active, wanted, old);
    const V change = impulse - old;
    rows_.put(k, kImpulse, impulse);
    rows_.template apply<kPair>(group, normal, change, a, b);
    largest = hn::Max(largest, hn::Abs(change) * rows_.get(k, kResponse));
    // Friction: a projected gradient step with one step size for both directions. Where it stands still, friction is
    // either below its limit with no slip, or at its limit and exactly opposed to the slip.
    const V limit = rows_.get(k, kMu) * impulse;
    const V step = rows_.get(k, kSlipStep);
    const V old_1 = rows_.get(k, kSlip1);
    const V old_2 = rows_.get(k, kSlip2);
    const Axis tangent_1 = rows_.template axis<kPair>(k, kTangent1);
    const Axis tangent_2 = rows_.template axis<kPair>(k, kTangent2);
    V slip_1 = old_1 - step * (rows_.get(k, kBase1) + rows_.template along<kPair>(tangent_1, a, b));
    V slip_2 = old_2 - step * (rows_.get(k, kBase2) + rows_.template along<kPair>(tangent_2, a, b));
    const V squared = slip_1 * slip_1 + slip_2 * slip_2;
    const auto too_large = hn::Gt(squared, limit * limit);
    const V scale = select(too_large, limit / hn::Sqrt(select(too_large, squared, one)), one);
    slip_1 = select(active, slip_1 * scale, old_1);
    slip_2 = select(active, slip_2 * scale, old_2);
    const V change_1 = slip_1 - old_1;
    const V change_2 = slip_2 - old_2;
    rows_.put(k, kSlip1, slip_1);
    rows_.put(k, kSlip2, slip_2);
    rows_.template apply<kPair>(group, tangent_1, change_1, a, b);
    rows_.template apply<kPair>(group, tangent_2, change_2, a, b);
    largest = hn::Max(largest, hn::Max(hn::Abs(change_1), hn::Abs(change_2)) * rows_.get(k, kPerSlipStep));
    if (rolls) largest = hn::Max(largest, solve_rolling<kPair>(group, k, impulse, active, a, b));
  }
  return largest;
}

template <bool kMany>
std::uint32_t LaneSolver<kMany>::iterate(int first, int last) {
  const D d;
  const V zero = set<V>(0.0);
  const V accuracy = set<V>(settings_.accuracy);
  auto active = hn::Eq(zero, zero);
  for (int iteration = first; iteration < last; ++iteration) {
    V largest = zero;
    for (const RowGroup& group : rows_.groups()) {
      with_rates(group, changes_, [&](auto pair, Rates& a, Rates& b) HWY_ATTR {
        largest = hn::Max(largest, solve_group<decltype(pair)::value>(group, active, a, b));
      });
    }
    active = hn::And(active, hn::Gt(largest, accuracy));
    if (hn::AllFalse(d, active)) break;
  }
  std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(d, active, bytes);
  return bytes[0] | static_cast<std::uint32_t>(bytes[1]) << 8;
}

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
template <bool kPair>
HWY_INLINE V LaneSolver<kMany>::push_group(const RowGroup& group, M active, Rates& a, Rates& b) {
  const V zero = set<V>(0.0);
  V largest = zero;
  for (int k = group.first; k < group.first + group.count; ++k) {
    const V old = rows_.get(k, kPushImpulse);
    const Axis normal = rows_.template axis<kPair>(k, kNormal);
    const V speed = rows_.template along<kPair>(normal, a, b);
    const V wanted = hn::Max(zero, old + (rows_.get(k, kPush) - speed) * rows_.get(k, kInverse));
    const V impulse = select(active, wanted, old);
    const V change = impulse - old;
    rows_.put(k, kPushImpulse, impulse);
    rows_.template apply<kPair>(group, normal, change, a, b);
    largest = hn::Max(largest, hn::Abs(change) * rows_.get(k, kResponse));
  }
  return largest;
}

template <bool kMany>
void LaneSolver<kMany>::push_out() {
  const D d;
  const V zero = set<V>(0.0);
  const V accuracy = set<V>(settings_.accuracy);
  // Only lanes with an overlap that is more than rounding: the others' bits do not depend on them.
  auto active = hn::Lt(zero, zero);
  for (int k = 0; k < rows_.row_count(); ++k) {
    active = hn::Or(active, hn::Gt(rows_.get(k, kPush), accuracy));
    rows_.put(k, kPushImpulse, zero);
  }
  for (int iteration = 0; iteration < settings_.iterations; ++iteration) {
    if (hn::AllFalse(d, active)) break;
    V largest = zero;
    for (const RowGroup& group : rows_.groups()) {
      with_rates(group, pushes_, [&](auto pair, Rates& a, Rates& b) HWY_ATTR {
        largest = hn::Max(largest, push_group<decltype(pair)::value>(group, active, a, b));
      });
    }
    active = hn::And(active, hn::Gt(largest, accuracy));
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
