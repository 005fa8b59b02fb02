// SPDX-License-Identifier: Apache-2.0
// Contact rows of a vector of instances. Velocities are in W; spins are in each object's frame P, scaled by the root of
// their moment for 1 kg, so that a row's response is (1 + |turn|^2) / mass for each object. With one object everything
// is for each kilogram.
#if defined(PRESCENE_SIMULATION_IMPULSE_ROWS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef PRESCENE_SIMULATION_IMPULSE_ROWS_INL_H_
#undef PRESCENE_SIMULATION_IMPULSE_ROWS_INL_H_
#else
#define PRESCENE_SIMULATION_IMPULSE_ROWS_INL_H_
#endif

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <type_traits>

#include "lane_math-inl.h"
#include "lane_state.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::simulation::HWY_NAMESPACE {

using D = hn::CappedTag<Real, kLaneMultiple>;
using V = hn::Vec<D>;
using M = hn::Mask<D>;

/// Of a contact in scratch memory, each a vector.
enum Field : int {
  kInverse = 0,  // 1 / response of the normal row
  kTarget = 1,   // normal velocity to reach, less what it is
  kBase1 = 2,    // slip velocities without impulses
  kBase2 = 3,
  kSlipStep = 4,
  kMu = 5,
  kImpulse = 6,
  kSlip1 = 7,
  kSlip2 = 8,
  kPush = 9,  // normal pseudo velocity to reach
  kPushImpulse = 10,
  kRollingArm = 11,
  kRolling = 12,   // rolling impulse: 3; with another object in W, else in P
  kPosition = 15,  // in the other part's frame, as WarmContact has it: 3
  kHit = 18,       // 1 or 0
  kBounced = 19,
  kHitTime = 20,
  kPart = 21,
  kResponse = 22,  // of the normal row
  kPerSlipStep = 23,
  kSpin = 24,  // of the kinematic body, P: 3
  kPerRollingStep = 27,
  kUpward = 55,  // of the normal, with several objects
  kAtEnd = 56,   // the gap where the step ends, if nothing changes what closes it
  kNormal = 28,  // direction 3, turn of the object 3, of the other one 3
  kTangent1 = 37,
  kTangent2 = 46,
};
static_assert(kTangent2 + 9 <= kUpward && kAtEnd < SolverScratch::kFields);

struct Rates {
  Vec3<V> velocity, spin;
};
HWY_INLINE Rates no_rates() { return {set3<V>(0.0, 0.0, 0.0), set3<V>(0.0, 0.0, 0.0)}; }

/// A direction that an impulse acts in, and how it turns the two objects.
struct Axis {
  Vec3<V> direction, turn_a, turn_b;
};

/// Rows of the same two bodies: object a with object b, or with all that is not an object (b = -1).
struct RowGroup {
  int a, b;
  int first, count;
};

/// What rows need of an object.
struct ObjectLanes {
  const LaneBody* body;
  Mat3<V> R;
  Vec3<V> p;
  Rates before, flown;
  Vec3<V> falling;  // m/s: velocity at the end if nothing is in the way
  V friction, impact_friction, restitution, travel, share;
  V owed;      // s: for how long gravity has not acted yet in `before`
  V pulled;    // s: for how long it has acted in `flown`
  V falls;     // s: for how long it still acts in this step if nothing is in the way
  V struck;    // 1 or 0: something hits it
  Rates anew;  // `flown` of what something hits
  V anew_pulled;
  V inverse_mass;
  Vec3<V> root, inverse_root;  // of the moments
};

/// 0 of 0: nothing that is held answers to an impulse. Rows of other lanes come to it, too.
HWY_INLINE V inverse_of(V value) {
  const V one = set<V>(1.0);
  const auto proper = hn::Gt(value, set<V>(0.0));
  return hn::IfThenElseZero(proper, one / select(proper, value, one));
}

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

/// The rows of the slots of one vector. kMany: of a scene with several objects.
template <bool kMany>
class ContactRows {
 public:
  static constexpr int kObjects = kMany ? kMaxObjects : 1;

  ContactRows(const LockstepScene& scene, LaneState& state, SolverScratch& scratch)
      : scene_(scene), settings_(scene.settings), state_(state), scratch_(scratch), memory_(scratch.memory()) {}

  /// Fills the rows, without impulses. Lanes beyond the last slot repeat it.
  void load(std::span<const std::int32_t> slots);
  /// Impulses of the step before, where a contact is still where it was; their effect into `changes`, by object.
  void warm_start(Rates* changes);

  std::size_t filled() const { return filled_; }
  std::int32_t slot(std::size_t lane) const { return slots_[lane]; }
  int objects() const { return kMany ? scene_.objects : 1; }
  int row_count() const { return row_count_; }
  std::span<const RowGroup> groups() const { return {groups_.data(), static_cast<std::size_t>(group_count_)}; }
  /// Null where a lane has no such contact.
  LaneContact* contact(int row, std::size_t lane) const { return scratch_.contacts(row)[lane]; }
  const ObjectLanes& object(int index) const { return objects_[static_cast<std::size_t>(index)]; }
  bool overlap() const { return overlap_; }  ///< In some lane, and more than rounding.
  bool rolls() const { return scene_.rolls; }
  /// Kinematic bodies may turn what rolls on them.
  bool has_spins() const { return scene_.rolls && scene_.has_kinematic(); }

  Real* field(int row, int f) const {
    return memory_ +
           (static_cast<std::size_t>(row) * SolverScratch::kFields + static_cast<std::size_t>(f)) * kLaneMultiple;
  }
  HWY_INLINE V get(int row, int f) const { return hn::Load(D(), field(row, f)); }
  HWY_INLINE void put(int row, int f, V value) const { hn::Store(value, D(), field(row, f)); }
  HWY_INLINE Vec3<V> get3(int row, int f) const { return {get(row, f), get(row, f + 1), get(row, f + 2)}; }
  HWY_INLINE void put3(int row, int f, const Vec3<V>& a) const {
    put(row, f, a.x);
    put(row, f + 1, a.y);
    put(row, f + 2, a.z);
  }

  // kPair: with another object. Where there is none, `b` is not looked at.
  template <bool kPair>
  HWY_INLINE Axis axis(int row, int f) const {
    const Vec3<V> none = set3<V>(0.0, 0.0, 0.0);
    return {get3(row, f), get3(row, f + 3), kPair ? get3(row, f + 6) : none};
  }
  template <bool kPair>
  static HWY_INLINE V along(const Axis& axis, const Rates& a, const Rates& b) {
    V speed = dot(axis.direction, a.velocity) + dot(axis.turn_a, a.spin);
    if constexpr (kPair) speed = speed - (dot(axis.direction, b.velocity) + dot(axis.turn_b, b.spin));
    return speed;
  }
  template <bool kPair>
  HWY_INLINE void apply(const RowGroup& group, const Axis& axis, V impulse, Rates& a, Rates& b) const {
    const V on_a = per_mass(group.a, impulse);
    a.velocity = a.velocity + axis.direction * on_a;
    a.spin = a.spin + axis.turn_a * on_a;
    if constexpr (kPair) {
      const V on_b = per_mass(group.b, impulse);
      b.velocity = b.velocity - axis.direction * on_b;
      b.spin = b.spin - axis.turn_b * on_b;
    }
  }
  HWY_INLINE V per_mass(int object_index, V value) const {
    if constexpr (kMany) return value * object(object_index).inverse_mass;
    return value;
  }
  /// Trace of the inverse inertia, scaled as the rows are.
  HWY_INLINE V softness(int object_index) const {
    const Vec3<V>& r = object(object_index).inverse_root;
    return per_mass(object_index, r.x * r.x + r.y * r.y + r.z * r.z);
  }

  V lanes_of(const Real* row, int object_index) const {
    HWY_ALIGN Real values[kLaneMultiple] = {};
    const Real* of_object = row + state_.at(object_index, 0);
    for (std::size_t i = 0; i < hn::Lanes(D()); ++i) values[i] = of_object[slots_[i]];
    return hn::Load(D(), values);
  }
  Vec3<V> lanes_of(const Rows<3>& rows, int object_index) const {
    return {lanes_of(rows[0], object_index), lanes_of(rows[1], object_index), lanes_of(rows[2], object_index)};
  }
  Quat<V> lanes_of(const Rows<4>& rows, int object_index) const {
    return {lanes_of(rows[0], object_index), lanes_of(rows[1], object_index), lanes_of(rows[2], object_index),
            lanes_of(rows[3], object_index)};
  }

 private:
  void find_heirs(const RowGroup& group, int warm_count, V reach);
  /// The other parts of a row's contacts.
  struct Others {
    HWY_ALIGN Real velocity[3][kLaneMultiple], spin[3][kLaneMultiple], origin[3][kLaneMultiple];
  };

  void gather_contacts();
  void load_objects();
  template <bool kPair>
  void load_row(const RowGroup& group, int row);
  template <bool kPair>
  /// `on_other_W` is the place of the other's surface from the middle of a.
  void load_motion(const RowGroup& group, int row, const Vec3<V>& on_other_W, V gap, V turning, V other_restitution,
                   V other_impact, V other_friction);
  void begin_struck_anew();
  void load_others(int row, Others& others) const;
  void note_supports();
  /// 1 in the lanes in which something else than `but` held an object up in the last step.
  V held_up(int object_index, int but) const;

  const LockstepScene& scene_;
  const StepSettings& settings_;
  LaneState& state_;
  SolverScratch& scratch_;
  Real* memory_;
  std::int32_t slots_[kLaneMultiple] = {};
  std::size_t filled_ = 0;
  std::array<RowGroup, kObjects*(kObjects + 1) / 2> groups_;
  int group_count_ = 0;
  int row_count_ = 0;
  ObjectLanes objects_[kObjects];
  std::uint32_t supports_[kObjects][kLaneMultiple] = {};  // a bit for each object, and one for all that is none
  bool overlap_ = false;
  HWY_ALIGN Real warm_[kMaxContacts][8][kLaneMultiple];
  HWY_ALIGN Real heirs_[kMaxContacts][kLaneMultiple];  // of each of these: a row, or -1
};

template <bool kMany>
void ContactRows<kMany>::gather_contacts() {
  group_count_ = 0;
  row_count_ = 0;
  const std::size_t width = hn::Lanes(D());
  for (int a = 0; a < objects(); ++a) {
    int next[kLaneMultiple] = {};
    // With each object after it, then with all that is not an object, as they were found.
    for (int b = kMany ? a + 1 : 1; b <= objects(); ++b) {
      const int first = row_count_;
      int most = 0;
      for (std::size_t i = 0; i < width; ++i) {
        const int at = state_.at(a, slots_[i]);
        const int count = state_.contact_count[static_cast<std::size_t>(at)];
        LaneContact* contacts = state_.contacts(at);
        int found = 0;
        for (; next[i] < count; ++next[i], ++found) {
          LaneContact& c = contacts[next[i]];
          if (b < objects() && scene_.parts[static_cast<std::size_t>(c.part)].body != b) break;
          if (found == most) {
            LaneContact** row = scratch_.contacts(first + most++);
            std::fill(row, row + kLaneMultiple, nullptr);
          }
          scratch_.contacts(first + found)[i] = &c;
        }
      }
      if (most == 0) continue;
      groups_[static_cast<std::size_t>(group_count_++)] = {a, b < objects() ? b : -1, first, most};
      row_count_ += most;
    }
  }
}

template <bool kMany>
void ContactRows<kMany>::load_objects() {
  for (int index = 0; index < objects(); ++index) {
    ObjectLanes& o = objects_[index];
    o.body = &scene_.bodies[static_cast<std::size_t>(index)];
    const auto& m = o.body->unit_moments;
    o.root = set3<V>(std::sqrt(m[0]), std::sqrt(m[1]), std::sqrt(m[2]));
    o.inverse_root = set3<V>(1.0 / std::sqrt(m[0]), 1.0 / std::sqrt(m[1]), 1.0 / std::sqrt(m[2]));
    const auto entry = [&](std::size_t k) HWY_ATTR { return lanes_of(state_.R[k], index); };
    o.R = {{entry(0), entry(1), entry(2)}, {entry(3), entry(4), entry(5)}, {entry(6), entry(7), entry(8)}};
    o.p = lanes_of(state_.p, index);
    o.before = {lanes_of(state_.v, index), times(transposed(o.R, lanes_of(state_.w, index)), o.root)};
    o.friction = lanes_of(state_.friction, index);
    o.impact_friction = lanes_of(state_.impact_friction, index);
    o.restitution = lanes_of(state_.restitution, index);
    o.travel = lanes_of(state_.travel, index);
    o.share = lanes_of(state_.share, index);
    const Vec3<V> gravity = set3<V>(settings_.gravity);
    const V lag = lanes_of(state_.lag, index);
    const V dt = set<V>(settings_.dt) * o.share;
    o.owed = lanes_of(state_.owed, index);
    o.falls = set<V>(0.5 * settings_.dt) * o.share;
    o.anew_pulled = o.owed + o.falls;
    const auto borne = hn::Gt(lag, set<V>(0.0));
    o.pulled = select(borne, lag + o.falls, o.anew_pulled);
    o.falling = o.before.velocity + gravity * o.owed + gravity * dt;  // as it flies
    if constexpr (kMany) {
      o.inverse_mass = lanes_of(state_.inverse_mass, index);
      const auto moves = hn::Gt(o.inverse_mass, set<V>(0.0));
      o.falls = hn::IfThenElseZero(moves, o.falls);
      o.pulled = hn::IfThenElseZero(moves, o.pulled);
      o.anew_pulled = hn::IfThenElseZero(moves, o.anew_pulled);
      o.falling = select(moves, o.falling, o.before.velocity);
    }
    // Contacts act on the velocity of the step's middle, and on the spin of its beginning, whose energy is that of this
    // pose.
    o.anew = {o.falling - gravity * o.falls, o.before.spin};
    o.flown = {select(borne, lanes_of(state_.middle_v, index) + gravity * o.pulled, o.anew.velocity),
               select(borne, times(transposed(o.R, lanes_of(state_.middle_w, index)), o.root), o.anew.spin)};
    o.struck = set<V>(0.0);
  }
}

template <bool kMany>
void ContactRows<kMany>::load(std::span<const std::int32_t> slots) {
  filled_ = slots.size();
  overlap_ = false;
  for (std::size_t i = 0; i < hn::Lanes(D()); ++i) slots_[i] = slots[std::min(i, filled_ - 1)];
  gather_contacts();
  load_objects();
  if constexpr (kMany) note_supports();
  for (const RowGroup& group : groups()) {
    for (int row = group.first; row < group.first + group.count; ++row) {
      if (kMany && group.b >= 0) {
        load_row<kMany>(group, row);
      } else {
        load_row<false>(group, row);
      }
    }
  }
  begin_struck_anew();
}

/// What something hits starts from its velocity as the step begins: what bore it since the middle of the step before
/// may let it go, and has done its share until then.
template <bool kMany>
void ContactRows<kMany>::begin_struck_anew() {
  const V zero = set<V>(0.0);
  const Vec3<V> none = set3<V>(0.0, 0.0, 0.0);
  Rates changes[kObjects];
  auto any = hn::Lt(zero, zero);
  for (int index = 0; index < objects(); ++index) {
    ObjectLanes& o = objects_[index];
    const auto struck = hn::Gt(o.struck, zero);
    any = hn::Or(any, struck);
    changes[index] = {select(struck, o.anew.velocity - o.flown.velocity, none),
                      select(struck, o.anew.spin - o.flown.spin, none)};
    o.flown.velocity = select(struck, o.anew.velocity, o.flown.velocity);
    o.flown.spin = select(struck, o.anew.spin, o.flown.spin);
    o.pulled = select(struck, o.anew_pulled, o.pulled);
  }
  if (hn::AllFalse(D(), any)) return;
  const auto correct = [&](const RowGroup& group, int row, auto pair) HWY_ATTR {
    constexpr bool kPair = decltype(pair)::value;
    const Rates& a = changes[group.a];
    const Rates& b = changes[kPair ? group.b : group.a];
    put(row, kTarget, get(row, kTarget) - along<kPair>(axis<kPair>(row, kNormal), a, b));
    put(row, kBase1, get(row, kBase1) + along<kPair>(axis<kPair>(row, kTangent1), a, b));
    put(row, kBase2, get(row, kBase2) + along<kPair>(axis<kPair>(row, kTangent2), a, b));
  };
  for (const RowGroup& group : groups()) {
    for (int row = group.first; row < group.first + group.count; ++row) {
      if (kMany && group.b >= 0) {
        correct(group, row, std::bool_constant<kMany>());
      } else {
        correct(group, row, std::false_type());
      }
    }
  }
}

}  // namespace prescene::simulation::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
