// SPDX-License-Identifier: Apache-2.0
// The iterations of sequential impulses over the rows of a vector of instances: the method of Bullet's stepper
// (simulation/bullet/contact_solver.h).
#if defined(PRESCENE_SIMULATION_IMPULSE_ITERATIONS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef PRESCENE_SIMULATION_IMPULSE_ITERATIONS_INL_H_
#undef PRESCENE_SIMULATION_IMPULSE_ITERATIONS_INL_H_
#else
#define PRESCENE_SIMULATION_IMPULSE_ITERATIONS_INL_H_
#endif

#include <span>
#include <type_traits>
#include <vector>

#include "impulse_rows-inl.h"
#include "lane_math-inl.h"
#include "lane_state.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::simulation::HWY_NAMESPACE {

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

}  // namespace prescene::simulation::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
