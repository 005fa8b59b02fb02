// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/outcomes/repeated_instances.h"

#include <algorithm>

#include "instance_classes.h"
#include "prescene/core/check.h"

namespace prescene::simulation {
namespace {

constexpr std::uint64_t kNearbyDraws = 0, kFreshDraws = 1;  // of random numbers

template <class MakeStart>
std::vector<belief::WorldState> started(const StartDistribution& starts, const OutcomeEstimate& estimate,
                                        std::size_t count, const core::RandomStream& stream, core::ThreadPool& pool,
                                        const MakeStart& make_start) {
  PRESCENE_CHECK(count <= estimate.instances.size());
  const std::vector<StartSampler> samplers = samplers_of(starts, stream);
  std::vector<belief::WorldState> states(count);
  pool.for_each_index(count, [&](std::size_t i) {
    const InstanceRecord& record = estimate.instances[i];
    const auto component = static_cast<std::size_t>(record.component);
    states[i] = make_start(i, samplers[component].uniforms(record.point), starts.components[component]);
  });
  return states;
}

}  // namespace

std::vector<belief::WorldState> starts_of(const StartDistribution& starts, const OutcomeEstimate& estimate,
                                          std::size_t count, const core::RandomStream& stream, core::ThreadPool& pool) {
  return started(starts, estimate, count, stream, pool,
                 [](std::size_t, const std::vector<double>& uniforms, const StartComponent& component) {
                   return component.draw(uniforms);
                 });
}

std::vector<belief::WorldState> starts_nearby(const StartDistribution& starts, const OutcomeEstimate& estimate,
                                              std::size_t count, double displacement, const core::RandomStream& stream,
                                              core::ThreadPool& pool) {
  constexpr double kLeast = 1e-12;  // uniform numbers stay within the open interval
  const core::RandomStream shifts = stream.for_purpose(core::Purpose::kNearbyStart);
  return started(starts, estimate, count, stream, pool,
                 [&](std::size_t i, std::vector<double> uniforms, const StartComponent& component) {
                   core::RandomStream draw = shifts.at(kNearbyDraws, static_cast<std::uint32_t>(i));
                   for (double& u : uniforms) {
                     const double z = core::inverse_normal_cdf(std::clamp(u, kLeast, 1.0 - kLeast));
                     u = std::clamp(core::normal_cdf(z + displacement * draw.normal()), kLeast, 1.0 - kLeast);
                   }
                   return component.draw(uniforms);
                 });
}

std::vector<belief::WorldState> fresh_starts(const StartDistribution& starts, std::uint32_t first, std::size_t count,
                                             const core::RandomStream& stream, core::ThreadPool& pool) {
  const core::RandomStream draws = stream.for_purpose(core::Purpose::kNearbyStart);
  std::vector<belief::WorldState> states(count);
  pool.for_each_index(count, [&](std::size_t i) {
    core::RandomStream draw = draws.at(kFreshDraws, first + static_cast<std::uint32_t>(i));
    const StartComponent& component = starts.chosen_by(draw.uniform());
    std::vector<double> uniforms(static_cast<std::size_t>(component.dimensions));
    for (double& u : uniforms) u = draw.uniform();
    states[i] = component.draw(uniforms);
  });
  return states;
}

std::optional<std::vector<std::vector<int>>> classes_from(const Simulator& simulator,
                                                          std::span<const belief::WorldState> starts,
                                                          std::span<const Variable> variables,
                                                          const RunRequest& request, const core::RandomStream& stream,
                                                          const Certifier* certifier, core::ThreadPool& pool,
                                                          const core::Cancellation* cancellation, std::uint32_t first) {
  constexpr std::size_t kAtOnce = 64;  // trajectories held in memory; does not change results
  RunRequest asked = request;
  asked.end_rule = certifier;
  std::vector<std::vector<int>> classes(starts.size());
  std::vector<belief::Trajectory> runs;
  for (std::size_t begin = 0; begin < starts.size(); begin += kAtOnce) {
    const std::size_t count = std::min(kAtOnce, starts.size() - begin);
    runs.assign(count, {});
    simulator.run(starts.subspan(begin, count), asked, stream, first + static_cast<std::uint32_t>(begin), pool, runs,
                  cancellation);
    for (std::size_t i = 0; i < count; ++i) {
      if (runs[i].end == belief::TrajectoryEnd::kCancelled) return std::nullopt;
      classes[begin + i] = classes_of(runs[i], variables, certifier, request.stop.duration);
    }
  }
  return classes;
}

}  // namespace prescene::simulation
