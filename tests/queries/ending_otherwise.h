// SPDX-License-Identifier: Apache-2.0
// Questions about the sliding scene whose runs end otherwise than by their duration.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "prescene/rendering/reference/reference_renderer.h"
#include "sliding_scene.h"

namespace prescene::tests {

/// A simulator whose runs are a formula, some of which end otherwise than by their duration.
class EndingOtherwise final : public simulation::Simulator {
 public:
  using End =
      std::function<std::optional<belief::TrajectoryEnd>(const belief::WorldState&, const simulation::RunRequest&)>;
  EndingOtherwise(FakeSimulator::Formula formula, End end) : fake_(std::move(formula)), end_(std::move(end)) {}

  void run(std::span<const belief::WorldState> starts, const simulation::RunRequest& request,
           const core::RandomStream& stream, simulation::InstanceNumbers numbers, core::ThreadPool& pool,
           std::span<belief::Trajectory> trajectories, const core::Cancellation* cancellation) const override {
    fake_.run(starts, request, stream, numbers, pool, trajectories, cancellation);
    for (std::size_t i = 0; i < starts.size(); ++i)
      if (const auto end = end_(starts[i], request)) trajectories[i].end = *end;
  }
  std::unique_ptr<simulation::Instance> make_instance(const std::vector<belief::Action>&,
                                                      const core::RandomStream&) const override {
    return nullptr;
  }

 private:
  FakeSimulator fake_;
  End end_;
};

inline queries::QueryContext context_ending(const EndingOtherwise::End& end, core::ThreadPool& pool) {
  queries::QueryContext context = context_with(slide, pool);
  context.make_simulator = [end](const belief::Scene&, double) -> core::Result<std::unique_ptr<simulation::Simulator>> {
    return std::unique_ptr<simulation::Simulator>(std::make_unique<EndingOtherwise>(slide, end));
  };
  context.make_renderer = []() -> core::Result<std::unique_ptr<rendering::Renderer>> {
    return rendering::make_reference_renderer();
  };
  return context;
}

/// Runs blow up whose carton is slippery (of a weight of 0.25), rough, or both.
inline EndingOtherwise::End blowing_up(bool slippery, bool rough) {
  return [=](const belief::WorldState& start, const simulation::RunRequest&) -> std::optional<belief::TrajectoryEnd> {
    if (start.objects[0].physical.friction < kSlideBelow ? slippery : rough) return belief::TrajectoryEnd::kDiverged;
    return std::nullopt;
  };
}

}  // namespace prescene::tests
