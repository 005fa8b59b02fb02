// SPDX-License-Identifier: Apache-2.0
// Instances that differ in what is done in them: a push along another line in each, say.
//
//   std::vector<std::vector<belief::Action>> actions(starts.size());   // of each instance
//   run_own_actions(*simulator, starts, actions, request, stream, 0, pool, runs);
#pragma once

#include <span>
#include <vector>

#include "prescene/simulation/simulator.h"

namespace prescene::simulation {

/// What a simulator implements beside Simulator if it can run such instances side by side.
class OwnActionsRunner {
 public:
  virtual ~OwnActionsRunner() = default;
  /// As run_own_actions().
  virtual void run_own(std::span<const belief::WorldState> starts, std::span<const std::vector<belief::Action>> actions,
                       const RunRequest& request, const core::RandomStream& stream, InstanceNumbers numbers,
                       core::ThreadPool& pool, std::span<belief::Trajectory> trajectories,
                       const core::Cancellation* cancellation) const = 0;
};

/// As Simulator::run(), but in instance i `actions[i]` are done instead of `request.actions`, which must be empty
/// (checked). Gives the bits of a call of run() for each instance; the simulator must support each list of actions
/// (checked). A simulator that is no OwnActionsRunner gets such calls, one for each run of equal neighbours.
void run_own_actions(const Simulator& simulator, std::span<const belief::WorldState> starts,
                     std::span<const std::vector<belief::Action>> actions, const RunRequest& request,
                     const core::RandomStream& stream, InstanceNumbers numbers, core::ThreadPool& pool,
                     std::span<belief::Trajectory> trajectories, const core::Cancellation* cancellation = nullptr);

}  // namespace prescene::simulation
