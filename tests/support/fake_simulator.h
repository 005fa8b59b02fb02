// SPDX-License-Identifier: Apache-2.0
// A simulator whose runs are a formula, for tests that need to know the true probabilities of outcomes.
#pragma once

#include <functional>

#include "prescene/simulation/simulator.h"

namespace prescene::tests {

class FakeSimulator final : public simulation::Simulator {
 public:
  /// The end of an instance from its start; `stream` is the instance's own. Pure.
  using Formula = std::function<belief::WorldState(const belief::WorldState& start,
                                                   const simulation::RunRequest& request, core::RandomStream stream)>;
  explicit FakeSimulator(Formula formula) : formula_(std::move(formula)) {}

  /// The trajectory has the start, samples on the straight line between every sample_interval, and the end after
  /// `request.stop.duration`. Cancelled before an instance: it ends with kCancelled.
  void run(std::span<const belief::WorldState> starts, const simulation::RunRequest& request,
           const core::RandomStream& stream, simulation::InstanceNumbers numbers, core::ThreadPool& pool,
           std::span<belief::Trajectory> trajectories, const core::Cancellation* cancellation) const override;
  /// Always empty: a formula has no steps.
  std::unique_ptr<simulation::Instance> make_instance(const std::vector<belief::Action>& actions,
                                                      const core::RandomStream& stream) const override;

 private:
  Formula formula_;
};

}  // namespace prescene::tests
