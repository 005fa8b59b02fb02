// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/backends.h"

#include "prescene/rendering/reference/reference_renderer.h"
#include "prescene/simulation/bullet/convex_decomposition.h"

namespace prescene::service {

Backends::Backends(core::ThreadPool& pool, const BackendSettings& settings)
    : pool_(pool), settings_(settings), shapes_(simulation::hacd_decomposer()) {}

core::Result<std::unique_ptr<simulation::Simulator>> Backends::make_simulator(const belief::Scene& scene) {
  return simulation::make_bullet_simulator(scene, shapes_, settings_.bullet);
}

core::Result<std::unique_ptr<rendering::Renderer>> Backends::make_renderer() {
  return rendering::make_reference_renderer();
}

queries::QueryContext Backends::query_context(core::ThreadPool& pool) {
  queries::QueryContext context;
  context.make_simulator = [this](const std::shared_ptr<const belief::Scene>& scene) { return make_simulator(*scene); };
  context.make_renderer = [this] { return make_renderer(); };
  context.pool = &pool;
  context.meshes = &meshes_;
  return context;
}

}  // namespace prescene::service
