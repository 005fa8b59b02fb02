// SPDX-License-Identifier: Apache-2.0
// What one simulated instance did.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "prescene/belief/scene.h"
#include "prescene/belief/timeline.h"

namespace prescene::belief {

/// Why an instance ended. kDecided: what was asked of it could not change any more; it was not run to rest.
enum class TrajectoryEnd { kAtRest, kDuration, kLeftTheWorld, kDiverged, kCancelled, kDecided };

/// Two things touched during [begin, end], s since the scene's start. Bodies are numbered objects first, then supports,
/// then robot bodies, in the scene's order; pushers made by actions follow. first < second.
struct ContactInterval {
  int first = 0;
  int second = 0;
  double begin = 0.0;
  double end = 0.0;
  double largest_impulse = 0.0;  ///< N s, within one step of the simulator.
  /// Share along up_of(scene) of the mean unit normal at the last step, from `second` to `first`: 1 = first lies flat
  /// on second, -1 = second lies on first, 0 = side by side. A contact supports when it is beyond +-0.5.
  double normal_z = 0.0;
  friend bool operator==(const ContactInterval&, const ContactInterval&) = default;
};

/// Sampled states (the first is the start, the last the end), contacts, and how it ended.
struct Trajectory {
  std::vector<WorldState> states;
  std::vector<ContactInterval> contacts;  ///< Ordered by (begin, first, second).
  /// Pairs (object, body) in contact at the end.
  std::vector<std::pair<int, int>> final_contacts;
  TrajectoryEnd end = TrajectoryEnd::kDuration;
  double simulated_seconds = 0.0;
  double flown_seconds = 0.0;  ///< Of these, what took no search for contacts.
  /// How deep two objects overlapped at the start or when something was let go, m. 0 where the simulator does
  /// not report it.
  double deepest_overlap = 0.0;
  /// Contacts that steps found and had no room for, summed over the steps: these were solved without them.
  std::int64_t dropped_contacts = 0;
  friend bool operator==(const Trajectory&, const Trajectory&) = default;

  const WorldState& start() const { return states.front(); }
  const WorldState& final() const { return states.back(); }
};

/// Named relations read off a trajectory: contact, supports (contact from below), inside (volumes of the scene's
/// outcomes and open containers), holds, moving, upright (within 15 degrees of the start's vertical), falling.
Timeline timeline_of(const Scene& scene, const Trajectory& trajectory);

}  // namespace prescene::belief
