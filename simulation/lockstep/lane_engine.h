// SPDX-License-Identifier: Apache-2.0
// Live instances in slots, and one step of them.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "compile_scene.h"
#include "lane_state.h"

namespace prescene::simulation {

/// A slot's state apart from the others': plain numbers.
struct SlotState {
  Real p[3], v[3], w[3];
  Real q[4];
  int warm_count;
  WarmContact warm[kMaxContacts];
};

class LaneEngine {
 public:
  LaneEngine(std::shared_ptr<const CompiledLockstep> scene, int slots);

  const CompiledLockstep& scene() const { return *scene_; }
  int slots() const { return state_.slots(); }

  void reset(int slot, const belief::ObjectState& start);
  /// Pose and velocities into `object`; what else it holds stays.
  void read(int slot, belief::ObjectState& object) const;
  /// The whole of slot `from`, parameters included, into slot `to`.
  void move(int from, int to);
  void save(int slot, SlotState& saved) const;
  void restore(int slot, const SlotState& saved);

  /// Flies slots [0, wanted.size()) and finds the contacts of those with wanted[slot] != 0.
  void find_contacts(std::span<const std::uint8_t> wanted);
  /// Ends the step of those with wanted[slot] != 0: impulses and poses. After find_contacts.
  void advance(std::span<const std::uint8_t> wanted);

  // Of a slot after a step.
  double energy(int slot) const { return static_cast<double>(state_.energy[slot]); }
  double distance_squared(int slot) const { return static_cast<double>(state_.distance2[slot]); }
  /// Some number is not finite or some speed beyond 1e4.
  bool diverged(int slot) const;
  void stop(int slot);
  std::span<const LaneContact> contacts(int slot) {
    return {state_.contacts(slot), static_cast<std::size_t>(state_.contact_count[static_cast<std::size_t>(slot)])};
  }

  /// From the local origin.
  Vector3d center_of_mass(int slot) const;
  geometry::Quaterniond rotation(int slot) const;
  /// Turns the object about an axis through its centre of mass and stops it.
  void nudge(int slot, const Vector3d& axis_W, double angle);

 private:
  std::shared_ptr<const CompiledLockstep> scene_;
  LaneState state_;
  LanePairs pairs_;
  SolverScratch scratch_;
  std::vector<std::int32_t> touching_, flying_;
  std::vector<int> starts_;  // of counting sort
};

}  // namespace prescene::simulation
