// SPDX-License-Identifier: Apache-2.0
// Sequential impulses in lanes: the method of Bullet's stepper (simulation/bullet/contact_solver.h), for one body in
// its own frame P. Spins are scaled by the root of their moment, so that a row is six numbers and its response 1 +
// |turn|^2; impulses are per kilogram.
#include <algorithm>
#include <cmath>
#include <iterator>

#include "lane_state.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "impulses.cc"
#include <hwy/foreach_target.h>
// After foreach_target.h, which includes this file once for each instruction set.
#include <hwy/highway.h>

#include "lane_math-inl.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::simulation::HWY_NAMESPACE {

using D = hn::CappedTag<Real, kLaneMultiple>;
using V = hn::Vec<D>;
using M = hn::Mask<D>;

/// Rows of a contact in scratch memory, each a vector.
enum Field : int {
  kNormal = 0,  // direction 3, turn 3
  kTangent1 = 6,
  kTangent2 = 12,
  kInverse = 18,  // 1 / response of the normal row
  kTarget = 19,   // normal velocity to reach, less what it is
  kBase1 = 20,    // slip velocities without impulses
  kBase2 = 21,
  kSlipStep = 22,
  kMu = 23,
  kImpulse = 24,
  kSlip1 = 25,
  kSlip2 = 26,
  kPush = 27,  // normal pseudo velocity to reach
  kPushImpulse = 28,
  kRollingArm = 29,
  kRolling = 30,    // rolling impulse, scaled spin: 3
  kPositionW = 33,  // 3
  kHit = 36,        // 1 or 0
  kBounced = 37,
  kHitTime = 38,
  kPart = 39,
  kResponse = 40,  // of the normal row
  kPerSlipStep = 41,
};
static_assert(kPerSlipStep < SolverScratch::kFields);

constexpr int kKeptFields[] = {kImpulse, kSlip1, kSlip2, kRolling, kRolling + 1, kRolling + 2};

// Most lanes settle within a few iterations and one in thirty takes all of them. After each of these many iterations
// the lanes that have not settled are gathered into new vectors.
constexpr int kRounds[] = {8, 20};

struct Rates {
  Vec3<V> velocity, spin;
};

class LaneSolver {
 public:
  LaneSolver(const LockstepScene& scene, LaneState& state, SolverScratch& scratch)
      : scene_(scene), settings_(scene.settings), state_(state), scratch_(scratch), memory_(scratch.memory()) {}

  /// Iterations [first, last) of a vector of slots. Those that are settled, or all if last is the last one at all, end
  /// their step; the others are kept for the next round and appended to `unsettled`.
  void run(std::span<const std::int32_t> slots, int first, int last, std::vector<std::int32_t>& unsettled);

 private:
  Real* field(int contact, int f) const {
    return memory_ +
           (static_cast<std::size_t>(contact) * SolverScratch::kFields + static_cast<std::size_t>(f)) * kLaneMultiple;
  }
  V get(int contact, int f) const { return hn::Load(D(), field(contact, f)); }
  void put(int contact, int f, V value) const { hn::Store(value, D(), field(contact, f)); }
  Vec3<V> get3(int contact, int f) const { return {get(contact, f), get(contact, f + 1), get(contact, f + 2)}; }
  void put3(int contact, int f, const Vec3<V>& a) const {
    put(contact, f, a.x);
    put(contact, f + 1, a.y);
    put(contact, f + 2, a.z);
  }
  template <std::size_t N>
  V lanes_of(const Rows<N>& rows, std::size_t k) const {
    return lanes_of(rows[k]);
  }
  V lanes_of(const Real* row) const {
    HWY_ALIGN Real values[kLaneMultiple] = {};
    for (std::size_t i = 0; i < hn::Lanes(D()); ++i) values[i] = row[slots_[i]];
    return hn::Load(D(), values);
  }
  Vec3<V> lanes3_of(const Rows<3>& rows) const { return {lanes_of(rows[0]), lanes_of(rows[1]), lanes_of(rows[2])}; }
  Quat<V> lanes4_of(const Rows<4>& rows) const {
    return {lanes_of(rows[0]), lanes_of(rows[1]), lanes_of(rows[2]), lanes_of(rows[3])};
  }
  void set_lanes(V value, Real* row) const {
    HWY_ALIGN Real values[kLaneMultiple] = {};
    hn::Store(value, D(), values);
    for (std::size_t i = 0; i < filled_; ++i) {
      if (ends_ >> i & 1U) row[slots_[i]] = values[i];
    }
  }

  void load_contact(int contact);
  void warm_start(int contact);
  /// Returns a bit for each lane that has not settled.
  std::uint32_t iterate(int first, int last);
  void keep(std::uint32_t lanes);
  void resume();
  void push_out();
  void finish();

  HWY_INLINE V along(int contact, int row, const Rates& rates) const {
    return dot(get3(contact, row), rates.velocity) + dot(get3(contact, row + 3), rates.spin);
  }
  HWY_INLINE void apply(int contact, int row, V impulse, Rates& rates) const {
    rates.velocity = rates.velocity + get3(contact, row) * impulse;
    rates.spin = rates.spin + get3(contact, row + 3) * impulse;
  }

  const LockstepScene& scene_;
  const StepSettings& settings_;
  LaneState& state_;
  SolverScratch& scratch_;
  Real* memory_;
  std::int32_t slots_[kLaneMultiple] = {};
  std::size_t filled_ = 0;
  std::uint32_t ends_ = 0;  // lanes whose step ends
  int count_ = 0;           // contacts of the lane that has most
  int warm_count_ = 0;      // likewise
  Mat3<V> R_;
  Vec3<V> p_;
  Rates before_, flown_;  // spins scaled
  V friction_, impact_friction_, restitution_, reach2_;
  Vec3<V> root_, inverse_root_;
  Rates change_;
  Rates push_;
  bool overlap_ = false;
  HWY_ALIGN Real warm_[kMaxContacts][8][kLaneMultiple];
};

/// When gap + speed t + acceleration t^2 / 2 becomes zero, within [0, dt].
HWY_INLINE V time_to_close(V gap, V speed, V acceleration, V dt) {
  const V zero = set<V>(0.0);
  const V two = set<V>(2.0);
  const V discriminant = speed * speed - two * acceleration * gap;
  const V root = hn::Sqrt(hn::Max(discriminant, zero));
  const V divisor = root - speed;
  const auto proper = hn::Gt(divisor, zero);
  const V time = two * gap / select(proper, divisor, set<V>(1.0));
  return select(hn::And(proper, hn::Gt(discriminant, zero)), hn::Min(hn::Max(time, zero), dt), dt);
}

void LaneSolver::load_contact(int k) {
  const D d;
  const V zero = set<V>(0.0);
  const V one = set<V>(1.0);
  HWY_ALIGN Real raw[12][kLaneMultiple];
  for (std::size_t i = 0; i < hn::Lanes(d); ++i) {
    const std::int32_t slot = slots_[i];
    if (k < state_.contact_count[static_cast<std::size_t>(slot)]) {
      const LaneContact& c = state_.contacts(slot)[k];
      const FixedPart& fixed = scene_.fixed[static_cast<std::size_t>(c.part)];
      for (std::size_t j = 0; j < 3; ++j) {
        raw[j][i] = c.position[j];
        raw[3 + j][i] = c.normal[j];
      }
      raw[6][i] = c.gap;
      raw[7][i] = fixed.friction;
      raw[8][i] = fixed.impact_friction;
      raw[9][i] = fixed.restitution;
      raw[10][i] = fixed.rolling_arm;
      raw[11][i] = static_cast<Real>(c.part);
    } else {
      // Far off: never pressed.
      for (auto& row : raw) row[i] = 0;
      raw[5][i] = 1;
      raw[6][i] = Real(1e6);
      raw[11][i] = -1;
    }
  }
  const auto column = [&](std::size_t j) HWY_ATTR { return hn::Load(d, raw[j]); };
  const Vec3<V> r{column(0), column(1), column(2)};
  const Vec3<V> n{column(3), column(4), column(5)};
  const V gap = column(6);
  Vec3<V> t1, t2;
  basis(n, t1, t2);
  const auto put_row = [&](int at, const Vec3<V>& direction) HWY_ATTR {
    const Vec3<V> turn = times(cross(r, direction), inverse_root_);
    put3(k, at, direction);
    put3(k, at + 3, turn);
    return turn;
  };
  const Vec3<V> turn_n = put_row(kNormal, n);
  const Vec3<V> turn_1 = put_row(kTangent1, t1);
  const Vec3<V> turn_2 = put_row(kTangent2, t2);
  const V response = one + dot(turn_n, turn_n);
  put(k, kResponse, response);
  put(k, kInverse, one / response);
  const V k11 = one + dot(turn_1, turn_1);
  const V k22 = one + dot(turn_2, turn_2);
  const V k12 = dot(turn_1, turn_2);
  const V half = set<V>(0.5);
  const V difference = half * (k11 - k22);
  const V stiffest = half * (k11 + k22) + hn::Sqrt(difference * difference + k12 * k12);
  put(k, kPerSlipStep, stiffest);
  put(k, kSlipStep, one / stiffest);

  const V dt = set<V>(settings_.dt);
  const V per_dt = set<V>(1.0 / settings_.dt);
  const V speed = along(k, kNormal, flown_);
  const V speed_before = along(k, kNormal, before_);
  const auto closes = hn::Lt(gap + half * dt * (speed_before + speed), zero);
  const auto open = hn::Gt(gap, zero);
  const V close_by = hn::Neg(gap) * per_dt;
  const V resting = hn::IfThenElseZero(open, close_by);
  const auto hit = hn::And(closes, hn::Lt(speed_before, set<V>(-settings_.restitution_speed)));
  // The gap closes at hit_time with the speed it has then; what bounces goes on under gravity until the step ends. A
  // bounce that falls back within the step is none.
  const V acceleration = (speed - speed_before) * per_dt;
  const V hit_time = hn::IfThenElseZero(hn::And(hit, open), time_to_close(gap, speed_before, acceleration, dt));
  const V speed_at_hit = speed_before + acceleration * hit_time;
  const V bounce = hn::Max(zero, acceleration * (dt - hit_time) - restitution_ * column(9) * speed_at_hit);
  const V target = select(hit, bounce, resting);
  put(k, kTarget, target - speed);
  put(k, kHit, hn::IfThenElseZero(hit, one));
  put(k, kBounced, hn::IfThenElseZero(hn::And(hit, hn::Gt(bounce, zero)), one));
  put(k, kHitTime, hit_time);
  const V push = select(open, close_by, close_by * set<V>(settings_.overlap_recovery));
  put(k, kPush, push);
  overlap_ = overlap_ || !hn::AllFalse(d, hn::Gt(push, zero));
  const auto impact = hn::And(closes, hn::Lt(speed_before, set<V>(-settings_.impact_speed)));
  put(k, kMu, select(impact, impact_friction_ * column(8), friction_ * column(7)));
  put(k, kBase1, along(k, kTangent1, flown_));
  put(k, kBase2, along(k, kTangent2, flown_));
  put(k, kRollingArm, column(10));
  put3(k, kRolling, Vec3<V>{zero, zero, zero});
  put(k, kPart, column(11));
  put3(k, kPositionW, p_ + R_ * r);
}

void LaneSolver::warm_start(int k) {
  const D d;
  const V part = get(k, kPart);
  const Vec3<V> position = get3(k, kPositionW);
  V nearest = reach2_;
  V impulse = set<V>(0.0);
  Vec3<V> slip = set3<V>(0.0, 0.0, 0.0);
  for (int j = 0; j < warm_count_; ++j) {
    const auto column = [&](std::size_t f) HWY_ATTR { return hn::Load(d, warm_[j][f]); };
    const Vec3<V> apart = Vec3<V>{column(0), column(1), column(2)} - position;
    const V squared = dot(apart, apart);
    const auto nearer = hn::And(hn::Eq(part, column(7)), hn::Lt(squared, nearest));
    nearest = select(nearer, squared, nearest);
    impulse = select(nearer, column(3), impulse);
    slip = select(nearer, Vec3<V>{column(4), column(5), column(6)}, slip);
  }
  const Vec3<V> slip_P = transposed(R_, slip);
  V slip_1 = dot(slip_P, get3(k, kTangent1));
  V slip_2 = dot(slip_P, get3(k, kTangent2));
  const V limit = get(k, kMu) * impulse;
  const V size = hn::Sqrt(slip_1 * slip_1 + slip_2 * slip_2);
  const auto too_large = hn::Gt(size, limit);
  const V scale = select(too_large, limit / select(too_large, size, set<V>(1.0)), set<V>(1.0));
  slip_1 = slip_1 * scale;
  slip_2 = slip_2 * scale;
  put(k, kImpulse, impulse);
  put(k, kSlip1, slip_1);
  put(k, kSlip2, slip_2);
  apply(k, kNormal, impulse, change_);
  apply(k, kTangent1, slip_1, change_);
  apply(k, kTangent2, slip_2, change_);
}

std::uint32_t LaneSolver::iterate(int first, int last) {
  const D d;
  const V zero = set<V>(0.0);
  const V one = set<V>(1.0);
  const V accuracy = set<V>(settings_.accuracy);
  const V per_rolling_step =
      inverse_root_.x * inverse_root_.x + inverse_root_.y * inverse_root_.y + inverse_root_.z * inverse_root_.z;
  const V rolling_step = one / per_rolling_step;
  // Copies that no store can change.
  Rates rates = change_;
  const bool rolls = scene_.rolls;
  const int count = count_;
  auto active = hn::Eq(zero, zero);
  for (int iteration = first; iteration < last; ++iteration) {
    V largest = zero;
    for (int k = 0; k < count; ++k) {
      // Normal.
      const V inverse = get(k, kInverse);
      const V old = get(k, kImpulse);
      const V wanted = hn::Max(zero, old + (get(k, kTarget) - along(k, kNormal, rates)) * inverse);
      const V impulse = select(active, wanted, old);
      const V change = impulse - old;
      put(k, kImpulse, impulse);
      apply(k, kNormal, change, rates);
      largest = hn::Max(largest, hn::Abs(change) * get(k, kResponse));
      // Friction: a projected gradient step with one step size for both directions. Where it stands still, friction is
      // either below its limit with no slip, or at its limit and exactly opposed to the slip.
      const V limit = get(k, kMu) * impulse;
      const V step = get(k, kSlipStep);
      const V old_1 = get(k, kSlip1);
      const V old_2 = get(k, kSlip2);
      V slip_1 = old_1 - step * (get(k, kBase1) + along(k, kTangent1, rates));
      V slip_2 = old_2 - step * (get(k, kBase2) + along(k, kTangent2, rates));
      const V squared = slip_1 * slip_1 + slip_2 * slip_2;
      const auto too_large = hn::Gt(squared, limit * limit);
      const V scale = select(too_large, limit / hn::Sqrt(select(too_large, squared, one)), one);
      slip_1 = select(active, slip_1 * scale, old_1);
      slip_2 = select(active, slip_2 * scale, old_2);
      const V change_1 = slip_1 - old_1;
      const V change_2 = slip_2 - old_2;
      put(k, kSlip1, slip_1);
      put(k, kSlip2, slip_2);
      apply(k, kTangent1, change_1, rates);
      apply(k, kTangent2, change_2, rates);
      largest = hn::Max(largest, hn::Max(hn::Abs(change_1), hn::Abs(change_2)) * get(k, kPerSlipStep));
      if (!rolls) continue;
      // Rolling friction, in spins that are not scaled: impulse I^-1/2 goes into the scaled one.
      const V arm = get(k, kRollingArm);
      const Vec3<V> old_roll = get3(k, kRolling);
      const Vec3<V> spin = times(flown_.spin + rates.spin, inverse_root_);
      Vec3<V> roll = old_roll - spin * rolling_step;
      const V roll_limit = arm * impulse;
      const V roll_size = length(roll);
      const auto roll_large = hn::Gt(roll_size, roll_limit);
      roll = roll * select(roll_large, roll_limit / select(roll_large, roll_size, one), one);
      roll = select(hn::And(active, hn::Gt(arm, zero)), roll, old_roll);
      const Vec3<V> roll_change = roll - old_roll;
      put3(k, kRolling, roll);
      rates.spin = rates.spin + times(roll_change, inverse_root_);
      largest = hn::Max(largest, length(roll_change) * per_rolling_step * arm);
    }
    active = hn::And(active, hn::Gt(largest, accuracy));
    if (hn::AllFalse(d, active)) break;
  }
  change_ = rates;
  std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(d, active, bytes);
  return bytes[0] | static_cast<std::uint32_t>(bytes[1]) << 8;
}

void LaneSolver::keep(std::uint32_t lanes) {
  const D d;
  HWY_ALIGN Real rates[6][kLaneMultiple];
  hn::Store(change_.velocity.x, d, rates[0]);
  hn::Store(change_.velocity.y, d, rates[1]);
  hn::Store(change_.velocity.z, d, rates[2]);
  hn::Store(change_.spin.x, d, rates[3]);
  hn::Store(change_.spin.y, d, rates[4]);
  hn::Store(change_.spin.z, d, rates[5]);
  for (std::size_t i = 0; i < filled_; ++i) {
    if (!(lanes >> i & 1U)) continue;
    Real* kept = scratch_.kept(slots_[i]);
    for (const auto& rate : rates) *kept++ = rate[i];
    for (int k = 0; k < state_.contact_count[static_cast<std::size_t>(slots_[i])]; ++k) {
      for (const int f : kKeptFields) *kept++ = field(k, f)[i];
    }
  }
}

void LaneSolver::resume() {
  const D d;
  HWY_ALIGN Real rates[6][kLaneMultiple] = {};
  for (std::size_t i = 0; i < hn::Lanes(d); ++i) {
    const Real* kept = scratch_.kept(slots_[i]);
    for (auto& rate : rates) rate[i] = *kept++;
    const int contacts = state_.contact_count[static_cast<std::size_t>(slots_[i])];
    for (int k = 0; k < count_; ++k) {
      for (const int f : kKeptFields) {
        field(k, f)[i] = k < contacts ? *kept++ : Real(0);
      }
    }
  }
  change_.velocity = {hn::Load(d, rates[0]), hn::Load(d, rates[1]), hn::Load(d, rates[2])};
  change_.spin = {hn::Load(d, rates[3]), hn::Load(d, rates[4]), hn::Load(d, rates[5])};
}

void LaneSolver::push_out() {
  const D d;
  const V zero = set<V>(0.0);
  const V accuracy = set<V>(settings_.accuracy);
  Rates rates = {set3<V>(0.0, 0.0, 0.0), set3<V>(0.0, 0.0, 0.0)};
  // Only lanes with an overlap: the others' bits do not depend on them.
  auto active = hn::Lt(zero, zero);
  for (int k = 0; k < count_; ++k) {
    active = hn::Or(active, hn::Gt(get(k, kPush), zero));
    put(k, kPushImpulse, zero);
  }
  for (int iteration = 0; iteration < settings_.iterations; ++iteration) {
    if (hn::AllFalse(d, active)) break;
    V largest = zero;
    for (int k = 0; k < count_; ++k) {
      const V inverse = get(k, kInverse);
      const V old = get(k, kPushImpulse);
      const V wanted = hn::Max(zero, old + (get(k, kPush) - along(k, kNormal, rates)) * inverse);
      const V impulse = select(active, wanted, old);
      const V change = impulse - old;
      put(k, kPushImpulse, impulse);
      apply(k, kNormal, change, rates);
      largest = hn::Max(largest, hn::Abs(change) * get(k, kResponse));
    }
    active = hn::And(active, hn::Gt(largest, accuracy));
  }
  push_ = rates;
}

void LaneSolver::finish() {
  const V zero = set<V>(0.0);
  const V dt = set<V>(settings_.dt);
  const V half = set<V>(0.5);
  auto touched = hn::Lt(zero, zero);
  auto supported = touched;
  auto bounced = touched;
  auto any_hit = touched;
  V hit_time = dt;
  for (int k = 0; k < count_; ++k) {
    const auto pressed = hn::Gt(get(k, kImpulse), zero);
    const auto hit = hn::Gt(get(k, kHit), zero);
    touched = hn::Or(touched, pressed);
    supported = hn::Or(supported, hn::AndNot(hit, pressed));
    bounced = hn::Or(bounced, hn::And(pressed, hn::Gt(get(k, kBounced), zero)));
    const auto lands = hn::And(pressed, hit);
    any_hit = hn::Or(any_hit, lands);
    hit_time = select(lands, hn::Min(hit_time, get(k, kHitTime)), hit_time);
  }
  const V before = hn::IfThenElseZero(any_hit, hit_time);
  const V after = dt - before;
  const Vec3<V> gravity = set3<V>(settings_.gravity);
  const V falls_before = hn::IfThenElseZero(hn::Not(supported), half * before);
  const V falls_after = hn::IfThenElseZero(hn::AndNot(supported, bounced), hn::Neg(half * after));
  const Vec3<V> v = lanes3_of(state_.v);
  const Vec3<V> w = lanes3_of(state_.w);
  const Vec3<V> flown_v = lanes3_of(state_.flown_v);
  const Vec3<V> flown_w = lanes3_of(state_.flown_w);
  const Vec3<V> new_v = select(touched, flown_v + R_ * change_.velocity, flown_v);
  const Vec3<V> new_w = select(touched, flown_w + R_ * times(change_.spin, inverse_root_), flown_w);
  const Vec3<V> push_v = R_ * push_.velocity * dt;
  const Vec3<V> push_w = R_ * times(push_.spin, inverse_root_) * dt;

  const Vec3<V> touched_p = p_ + (v + gravity * falls_before) * before + (new_v + gravity * falls_after) * after;
  const Vec3<V> new_p = select(touched, touched_p, lanes3_of(state_.flown_p)) + push_v;
  const Quat<V> q = lanes4_of(state_.q);
  const Quat<V> touched_q = turned(turned(q, w * before), new_w * after + push_w);
  const Quat<V> flown_q = lanes4_of(state_.flown_q);
  const Quat<V> new_q = select(touched, touched_q, turned(flown_q, push_w));
  set_lanes(new_v.x, state_.v[0]);
  set_lanes(new_v.y, state_.v[1]);
  set_lanes(new_v.z, state_.v[2]);
  set_lanes(new_w.x, state_.w[0]);
  set_lanes(new_w.y, state_.w[1]);
  set_lanes(new_w.z, state_.w[2]);
  set_lanes(new_p.x, state_.p[0]);
  set_lanes(new_p.y, state_.p[1]);
  set_lanes(new_p.z, state_.p[2]);
  set_lanes(new_q.w, state_.q[0]);
  set_lanes(new_q.x, state_.q[1]);
  set_lanes(new_q.y, state_.q[2]);
  set_lanes(new_q.z, state_.q[3]);

  for (std::size_t i = 0; i < filled_; ++i) {
    if (ends_ >> i & 1U) state_.warm_count[static_cast<std::size_t>(slots_[i])] = 0;
  }
  for (int k = 0; k < count_; ++k) {
    const Vec3<V> slip = R_ * (get3(k, kTangent1) * get(k, kSlip1) + get3(k, kTangent2) * get(k, kSlip2));
    put3(k, kTangent1, slip);
    for (std::size_t i = 0; i < filled_; ++i) {
      const std::int32_t slot = slots_[i];
      if (!(ends_ >> i & 1U) || k >= state_.contact_count[static_cast<std::size_t>(slot)]) continue;
      LaneContact& c = state_.contacts(slot)[k];
      c.impulse = field(k, kImpulse)[i];
      c.hit = c.impulse > 0 && field(k, kHit)[i] > 0 ? 1 : 0;
      if (c.impulse <= 0 || c.hit != 0) continue;
      WarmContact& warm = state_.warm(slot)[state_.warm_count[static_cast<std::size_t>(slot)]++];
      for (int j = 0; j < 3; ++j) {
        warm.position[j] = field(k, kPositionW + j)[i];
        warm.friction[j] = field(k, kTangent1 + j)[i];
      }
      warm.impulse = c.impulse;
      warm.part = c.part;
    }
  }
}

void LaneSolver::run(std::span<const std::int32_t> slots, int first, int last, std::vector<std::int32_t>& unsettled) {
  const D d;
  filled_ = slots.size();
  count_ = 0;
  warm_count_ = 0;
  overlap_ = false;
  for (std::size_t i = 0; i < hn::Lanes(d); ++i) {
    slots_[i] = slots[std::min(i, filled_ - 1)];
    count_ = std::max(count_, state_.contact_count[static_cast<std::size_t>(slots_[i])]);
    warm_count_ = std::max(warm_count_, state_.warm_count[static_cast<std::size_t>(slots_[i])]);
  }
  for (int j = 0; first == 0 && j < warm_count_; ++j) {
    for (std::size_t i = 0; i < hn::Lanes(d); ++i) {
      const std::int32_t slot = slots_[i];
      const bool there = j < state_.warm_count[static_cast<std::size_t>(slot)];
      const WarmContact& warm = state_.warm(slot)[j];
      for (std::size_t f = 0; f < 3; ++f) {
        warm_[j][f][i] = there ? warm.position[f] : Real(0);
        warm_[j][4 + f][i] = there ? warm.friction[f] : Real(0);
      }
      warm_[j][3][i] = there ? warm.impulse : Real(0);
      warm_[j][7][i] = there ? static_cast<Real>(warm.part) : Real(-2);
    }
  }
  const auto& m = scene_.unit_moments;
  root_ = set3<V>(std::sqrt(m[0]), std::sqrt(m[1]), std::sqrt(m[2]));
  inverse_root_ = set3<V>(1.0 / std::sqrt(m[0]), 1.0 / std::sqrt(m[1]), 1.0 / std::sqrt(m[2]));
  const auto row = [&](std::size_t k) HWY_ATTR { return lanes_of(state_.R[k]); };
  R_ = {{row(0), row(1), row(2)}, {row(3), row(4), row(5)}, {row(6), row(7), row(8)}};
  p_ = lanes3_of(state_.p);
  before_ = {transposed(R_, lanes3_of(state_.v)), times(transposed(R_, lanes3_of(state_.w)), root_)};
  flown_ = {transposed(R_, lanes3_of(state_.flown_v)), times(transposed(R_, lanes3_of(state_.flown_w)), root_)};
  friction_ = lanes_of(state_.friction);
  impact_friction_ = lanes_of(state_.impact_friction);
  restitution_ = lanes_of(state_.restitution);
  const V reach = lanes_of(state_.travel) + set<V>(1e-3);
  reach2_ = reach * reach;
  change_ = {set3<V>(0.0, 0.0, 0.0), set3<V>(0.0, 0.0, 0.0)};
  for (int k = 0; k < count_; ++k) load_contact(k);
  if (first == 0) {
    for (int k = 0; k < count_; ++k) warm_start(k);
  } else {
    resume();
  }
  const std::uint32_t all = (1U << filled_) - 1U;
  std::uint32_t left = iterate(first, last) & all;
  if (last == settings_.iterations) left = 0;
  if (left != 0) {
    keep(left);
    for (std::size_t i = 0; i < filled_; ++i) {
      if (left >> i & 1U) unsettled.push_back(slots_[i]);
    }
  }
  ends_ = all & ~left;
  if (ends_ == 0) return;
  push_ = {set3<V>(0.0, 0.0, 0.0), set3<V>(0.0, 0.0, 0.0)};
  if (overlap_) push_out();
  finish();
}

void solve_lanes(const LockstepScene* scene, const std::int32_t* slots, std::size_t count, LaneState* state,
                 SolverScratch* scratch) {
  const std::size_t width = hn::Lanes(D());
  LaneSolver solver(*scene, *state, *scratch);
  std::span<const std::int32_t> now(slots, count);
  int first = 0;
  for (std::size_t round = 0; !now.empty(); ++round) {
    const int iterations = scene->settings.iterations;
    const int last = round < std::size(kRounds) ? std::min(kRounds[round], iterations) : iterations;
    std::vector<std::int32_t>& next = scratch->unsettled(static_cast<int>(round % 2));
    next.clear();
    for (std::size_t begin = 0; begin < now.size(); begin += width) {
      solver.run(now.subspan(begin, std::min(width, now.size() - begin)), first, last, next);
    }
    now = next;
    first = last;
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
