// SPDX-License-Identifier: Apache-2.0
#include "benchmarks/plain_runs.h"

#include "prescene/core/check.h"
#include "prescene/service/backends.h"

namespace prescene::benchmarks {

std::vector<belief::Trajectory> plain_runs(const belief::Scene& scene, int count, double step, std::uint64_t seed,
                                           core::ThreadPool& pool) {
  service::BackendSettings settings;
  settings.stepper = service::Stepper::kBullet;
  service::Backends bullet(pool, settings);
  belief::Scene fine = scene;
  fine.step = step;
  const auto simulator = bullet.make_simulator(fine);
  PRESCENE_CHECK_MSG(simulator.ok(), simulator.status().message());
  core::RandomStream stream(seed, core::Purpose::kTest);
  std::vector<double> uniforms(static_cast<std::size_t>(belief::start_dimensions(scene)));
  std::vector<belief::WorldState> starts;
  for (int i = 0; i < count; ++i) {
    for (double& u : uniforms) u = stream.uniform();
    starts.push_back(belief::draw_start(scene, uniforms));
  }
  simulation::RunRequest request;
  request.actions = scene.actions;
  request.stop.duration = scene.duration;
  request.stop.stop_at_rest = scene.stop_at_rest;
  std::vector<belief::Trajectory> runs(starts.size());
  (*simulator)->run(starts, request, core::RandomStream(seed, core::Purpose::kEvaluation), 0, pool, runs);
  return runs;
}

}  // namespace prescene::benchmarks
