// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/own_actions.h"

#include <utility>

#include "prescene/core/check.h"

namespace prescene::simulation {

void run_own_actions(const Simulator& simulator, std::span<const belief::WorldState> starts,
                     std::span<const std::vector<belief::Action>> actions, const RunRequest& request,
                     const core::RandomStream& stream, InstanceNumbers numbers, core::ThreadPool& pool,
                     std::span<belief::Trajectory> trajectories, const core::Cancellation* cancellation) {
  PRESCENE_CHECK(starts.size() == actions.size() && starts.size() == trajectories.size());
  PRESCENE_CHECK(request.actions.empty());
  if (const auto* runner = dynamic_cast<const OwnActionsRunner*>(&simulator)) {
    runner->run_own(starts, actions, request, stream, numbers, pool, trajectories, cancellation);
    return;
  }
  std::vector<std::pair<std::size_t, std::size_t>> parts;  // begin, end
  for (std::size_t i = 0; i < actions.size(); ++i) {
    if (parts.empty() || !(actions[parts.back().first] == actions[i])) parts.emplace_back(i, i);
    parts.back().second = i + 1;
  }
  pool.for_each_index(parts.size(), [&](std::size_t part) {
    const auto [begin, end] = parts[part];
    std::vector<std::uint32_t> own;
    for (std::size_t i = begin; i < end; ++i) own.push_back(numbers[i]);
    RunRequest mine = request;
    mine.actions = actions[begin];
    simulator.run(starts.subspan(begin, end - begin), mine, stream, std::span<const std::uint32_t>(own), pool,
                  trajectories.subspan(begin, end - begin), cancellation);
  });
}

}  // namespace prescene::simulation
