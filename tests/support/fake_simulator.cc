// SPDX-License-Identifier: Apache-2.0
#include "tests/support/fake_simulator.h"

#include <cmath>

namespace prescene::tests {
namespace {

belief::WorldState between(const belief::WorldState& a, const belief::WorldState& b, double t) {
  belief::WorldState state = a;
  state.time = (1.0 - t) * a.time + t * b.time;
  for (std::size_t i = 0; i < state.objects.size(); ++i)
    state.objects[i].X_WO = geometry::interpolate(a.objects[i].X_WO, b.objects[i].X_WO, t);
  return state;
}

}  // namespace

void FakeSimulator::run(std::span<const belief::WorldState> starts, const simulation::RunRequest& request,
                        const core::RandomStream& stream, simulation::InstanceNumbers numbers, core::ThreadPool& pool,
                        std::span<belief::Trajectory> trajectories, const core::Cancellation* cancellation) const {
  pool.for_each_index(starts.size(), [&](std::size_t i) {
    belief::Trajectory& trajectory = trajectories[i];
    trajectory = {};
    trajectory.states.push_back(starts[i]);
    if (cancellation != nullptr && cancellation->requested()) {
      trajectory.end = belief::TrajectoryEnd::kCancelled;
      return;
    }
    const double duration = request.stop.duration;
    belief::WorldState end = formula_(starts[i], request, stream.at(0, numbers[i]));
    end.time = starts[i].time + duration;
    if (request.sample_interval > 0.0)
      for (double t = request.sample_interval; t < duration; t += request.sample_interval)
        trajectory.states.push_back(between(starts[i], end, t / duration));
    trajectory.states.push_back(std::move(end));
    trajectory.end = request.stop.stop_at_rest ? belief::TrajectoryEnd::kAtRest : belief::TrajectoryEnd::kDuration;
    trajectory.simulated_seconds = duration;
  });
}

std::unique_ptr<simulation::Instance> FakeSimulator::make_instance(const std::vector<belief::Action>&,
                                                                   const core::RandomStream&) const {
  return nullptr;
}

}  // namespace prescene::tests
