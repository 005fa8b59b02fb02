// SPDX-License-Identifier: Apache-2.0
// Live instances in slots, and one step of them.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "compile_scene.h"
#include "lane_spheres.h"
#include "lane_state.h"

namespace prescene::simulation {

/// How an object moves: by itself, as something else says, or not at all: beyond the world, or at rest on fixed bodies.
enum class LaneMotion : std::uint8_t { kFree, kHeld, kFrozen, kAsleep };

/// Most contacts with which an object falls asleep.
inline constexpr int kMostFooting = 16;

/// What the next step depends on of an object in a slot: plain numbers.
struct ObjectSlot {
  Real p[3], v[3], w[3];
  Real q[4];
  Real middle_v[3], middle_w[3], lag, owed;
  LaneMotion motion;
  std::uint64_t parting;  ///< See LaneEngine::release.
  int warm_count;
  WarmContact warm[kMaxContacts];
  int footing_count;  ///< Of what is asleep.
  LaneContact footing[kMostFooting];
};
using SlotState = std::vector<ObjectSlot>;  // by object

/// What the rows hold of a place.
inline Vector3d vector_at(const Rows<3>& rows, int at) {
  return {static_cast<double>(rows[0][at]), static_cast<double>(rows[1][at]), static_cast<double>(rows[2][at])};
}

class LaneEngine {
 public:
  LaneEngine(std::shared_ptr<const CompiledLockstep> scene, int slots);

  const CompiledLockstep& scene() const { return *scene_; }
  int slots() const { return state_.slots(); }
  int objects() const { return scene_->lanes.objects; }

  /// All objects free, kinematic bodies absent.
  void reset(int slot, const belief::WorldState& start);
  /// Pose and velocities into `state`; what else it holds stays.
  void read(int slot, int object, belief::ObjectState& state) const;
  /// The whole of slot `from`, parameters included, into slot `to`.
  void move(int from, int to);
  void save(int slot, SlotState& saved) const;
  void restore(int slot, const SlotState& saved);

  LaneMotion motion(int slot, int object) const { return moved_[place_of(object, slot)].motion; }
  bool free(int slot, int object) const { return motion(slot, object) == LaneMotion::kFree; }
  /// The object goes from X_now to X_next in the next steps, until this is called again.
  void hold(int slot, int object, const geometry::Pose& X_now, const geometry::Pose& X_next);
  /// To where hold() said, without a step.
  void arrive(int slot, int object);
  /// Free from now on. It does not touch kinematic bodies that it overlaps before they have parted.
  void release(int slot, int object, const geometry::Pose& X_WO, const geometry::Twist& V_WO);
  /// Changes the momentum (N s) of an object of that mass and its angular momentum about its centre of mass (N m s), if
  /// it is free or asleep, which it is no longer then. `within` is over what part of the step (s): 0 = at once; else it
  /// goes as far as if it were done evenly.
  void strike(int slot, int object, double mass, const Vector3d& impulse, const Vector3d& turn, double within);
  /// Sets the spin of a free object, rad/s.
  void turn_with(int slot, int object, const Vector3d& w_WO);
  /// Has left the world: stays where it is and touches nothing.
  void freeze(int slot, int object);
  /// At rest: stays where it is, with the contacts of this step, and nothing of it is computed until another object
  /// comes so near that it may touch it (lane_sleep.cc). Not if it has more than kMostFooting contacts. What moves it
  /// otherwise must be over.
  void fall_asleep(int slot, int object);
  /// Where a kinematic body (of lanes.bodies) is in the next step.
  void place(int slot, int body, const geometry::Pose& X_now, const geometry::Pose& X_next);
  void remove(int slot, int body) { present_[kinematic_of(body, slot)] = 0; }
  /// Whether a hand's force acts in the next step, which is not split then: it does what the whole step takes.
  void drive(int slot, bool driven) { driven_[static_cast<std::size_t>(slot)] = driven ? 1 : 0; }

  /// Flies slots [0, wanted.size()) and finds the contacts of those with wanted[slot] != 0.
  void find_contacts(std::span<const std::uint8_t> wanted);
  /// Ends the step of those with wanted[slot] != 0: impulses and poses. After find_contacts.
  ///
  /// Where something hits fast or a rim rolls fast, the step is split (lane_impacts.cc): it goes on to the impact,
  /// takes that by itself, and searches again for contacts for what is left. Contacts that pressed in a part of the
  /// step are then among contacts().
  void advance(std::span<const std::uint8_t> wanted);

  // Of an object after a step.
  double energy(int slot, int object) const { return static_cast<double>(state_.energy[state_.at(object, slot)]); }
  double distance_squared(int slot, int object) const {
    return static_cast<double>(state_.distance2[state_.at(object, slot)]);
  }
  /// Some number of the slot is not finite or some speed beyond 1e4.
  bool diverged(int slot) const;
  /// With the objects after it and with what is not an object; of what is asleep those that it fell asleep with.
  std::span<const LaneContact> contacts(int slot, int object) {
    if (motion(slot, object) != LaneMotion::kAsleep) return found(slot, object);
    const std::size_t place = place_of(object, slot);
    return {footings_.data() + place * kMostFooting, static_cast<std::size_t>(footing_counts_[place])};
  }

  /// Contacts of an object that the step had no room for.
  int dropped(int slot, int object) const { return state_.dropped_count[place_of(object, slot)]; }

  /// From the local origin.
  Vector3d center_of_mass(int slot, int object) const;
  /// Of the centre of mass.
  Vector3d velocity(int slot, int object) const;
  geometry::Quaterniond rotation(int slot, int object) const;
  /// Turns an object about an axis through its centre of mass and stops it.
  void nudge(int slot, int object, const Vector3d& axis_W, double angle);

 private:
  /// What moves an object that is not free.
  struct Moved {
    LaneMotion motion = LaneMotion::kFree;
    std::uint64_t parting = 0;  // by body
    Real inverse_mass = 0;
    Real next_p[3] = {}, next_q[4] = {};
  };

  /// Of a step, of what hands move.
  struct Way {
    geometry::Pose X_now, X_next;
  };

  std::size_t place_of(int object, int slot) const { return static_cast<std::size_t>(state_.at(object, slot)); }
  std::size_t kinematic_of(int body, int slot) const {
    return static_cast<std::size_t>(state_.at(body - objects(), slot));
  }
  /// The contacts of this step.
  std::span<const LaneContact> found(int slot, int object) {
    return {state_.contacts(state_.at(object, slot)),
            static_cast<std::size_t>(state_.contact_count[place_of(object, slot)])};
  }
  void set_pose(int slot, int object, const geometry::Pose& X_WO);
  void set_place(int slot, int body, const geometry::Pose& X_WB);
  void lead_held(int slot, int object, int from, int to);
  void set_motion(int slot, int object, LaneMotion motion);
  void guide(std::span<const std::uint8_t> wanted);
  void fly_all(std::span<const std::uint8_t> wanted);
  void touch_all(std::span<const std::uint8_t> wanted);
  void fly_and_touch(std::span<const std::uint8_t> wanted);
  void forget_contacts(int slot);
  bool wake(std::span<const std::uint8_t> wanted);
  void keep_places(std::span<const std::uint8_t> wanted);
  void copy_footing(std::size_t from, std::size_t to);
  void save_footing(std::size_t place, ObjectSlot& out) const;
  void restore_footing(std::size_t place, const ObjectSlot& in);
  void end_part(std::span<const std::uint8_t> wanted);
  // Split steps: lane_impacts.cc.
  void lead(int slot, int from, int to);
  Vector3d velocity_at(int slot, int body, const Vector3d& point) const;
  double rim_time(int slot, int body, const Vector3d& own, const Vector3d& normal, const Vector3d& spin) const;
  int parts_to_impact(int slot, int left);
  void split(std::span<const std::uint8_t> wanted);
  void shorten_contacts(int slot, int left);
  void set_share(int slot, int parts);
  void keep_pressed(int slot);
  void give_back_pressed();
  bool list_pair(int object, int body, std::span<const std::uint8_t> wanted);
  void touch_objects(int object, std::span<const std::uint8_t> wanted);
  void touch_surroundings(int object, std::span<const std::uint8_t> wanted);
  void touch_part(const ConvexPart& part, std::size_t other);
  void part(int object, std::span<const std::uint8_t> wanted);

  std::shared_ptr<const CompiledLockstep> scene_;
  LaneState state_;
  std::vector<Moved> moved_;           // by object
  std::vector<std::uint8_t> present_;  // of kinematic bodies
  std::vector<std::uint8_t> driven_;   // by slot
  std::vector<Way> ways_;              // by body, of what is kinematic in this step
  std::vector<int> footing_counts_;    // by object, of several
  std::vector<LaneContact> footings_;  // kMostFooting by object
  std::vector<std::uint8_t> woken_;
  LanePairs pairs_;
  SolverScratch scratch_;
  SphereScratch spheres_;
  std::vector<std::uint8_t> listed_;
  std::vector<std::int32_t> touching_, flying_;
  std::vector<int> totals_;  // contacts by slot
  std::vector<int> starts_;  // of counting sort
  // Of split steps.
  struct Pressed {
    int slot, object;
    LaneContact contact;
    Vector3d position_W, normal_W;
  };
  std::vector<std::uint8_t> going_, shortened_;
  std::vector<int> left_, taken_;  // parts of the step
  std::vector<Pressed> pressed_;
  std::vector<int> kept_;  // by object, of pressed_
};

}  // namespace prescene::simulation
