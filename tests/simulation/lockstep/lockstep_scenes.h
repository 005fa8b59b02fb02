// SPDX-License-Identifier: Apache-2.0
// The lockstep stepper of a scene and, beside it, Bullet's.
#pragma once

#include <memory>
#include <vector>

#include "prescene/core/check.h"
#include "prescene/simulation/bullet/bullet_simulator.h"
#include "prescene/simulation/bullet/convex_decomposition.h"
#include "prescene/simulation/lockstep/lockstep_simulator.h"
#include "tests/support/simple_scenes.h"

namespace prescene::tests {

using simulation::LockstepOptions;

inline std::unique_ptr<simulation::Simulator> bullet_of(const Scene& scene) {
  simulation::ShapeStore shapes(simulation::hacd_decomposer());
  auto simulator = simulation::make_bullet_simulator(scene, shapes);
  PRESCENE_CHECK(simulator.ok());
  return *std::move(simulator);
}

inline std::unique_ptr<simulation::Simulator> lockstep_of(const Scene& scene, const LockstepOptions& options = {}) {
  simulation::ShapeStore shapes(simulation::hacd_decomposer());
  auto simulator = simulation::make_lockstep_simulator(scene, shapes, options);
  if (!simulator) {
    const core::Status status = simulator.status();
    PRESCENE_CHECK_MSG(false, core::to_string(status));
  }
  return *std::move(simulator);
}

inline std::unique_ptr<simulation::Instance> lockstep_instance_of(const Scene& scene,
                                                                  const LockstepOptions& options = {}) {
  return lockstep_of(scene, options)->make_instance({}, core::RandomStream(1, core::Purpose::kTest));
}

inline belief::MeshShape hull_of(const geometry::TriangleMesh& mesh) {
  return {std::make_shared<const geometry::TriangleMesh>(mesh), Pose{}, belief::MeshUse::kConvexHull};
}

inline belief::MeshShape spheres_of(const geometry::TriangleMesh& mesh, const belief::SphereSettings& settings = {}) {
  return {std::make_shared<const geometry::TriangleMesh>(mesh), Pose{}, belief::MeshUse::kSpheres, settings};
}

/// Starts drawn from a scene's distributions by plain pseudo-random numbers.
inline std::vector<WorldState> drawn_starts(const Scene& scene, int count, std::uint64_t seed) {
  std::vector<WorldState> starts;
  core::RandomStream stream(seed, core::Purpose::kTest);
  std::vector<double> uniforms(static_cast<std::size_t>(belief::start_dimensions(scene)));
  for (int i = 0; i < count; ++i) {
    for (double& u : uniforms) u = stream.uniform();
    starts.push_back(belief::draw_start(scene, uniforms));
  }
  return starts;
}

inline std::vector<belief::Trajectory> run_all(const simulation::Simulator& simulator,
                                               const std::vector<WorldState>& starts,
                                               const simulation::RunRequest& request, int threads = 1,
                                               std::uint32_t first_instance = 0) {
  core::ThreadPool pool(threads);
  std::vector<belief::Trajectory> runs(starts.size());
  simulator.run(starts, request, core::RandomStream(5, core::Purpose::kTest), first_instance, pool, runs);
  return runs;
}

}  // namespace prescene::tests
