// SPDX-License-Identifier: Apache-2.0
// Bullet's stepper of a scene.
#pragma once

#include <memory>

#include "prescene/core/check.h"
#include "prescene/geometry/mass_properties.h"
#include "prescene/simulation/bullet/bullet_simulator.h"
#include "prescene/simulation/bullet/convex_decomposition.h"
#include "tests/support/simple_scenes.h"

namespace prescene::tests {

using simulation::BulletOptions;

inline std::unique_ptr<simulation::Simulator> simulator_of(const Scene& scene, const BulletOptions& options = {}) {
  simulation::ShapeStore shapes(simulation::hacd_decomposer());
  auto simulator = simulation::make_bullet_simulator(scene, shapes, options);
  if (!simulator) {
    const core::Status status = simulator.status();
    PRESCENE_CHECK_MSG(false, core::to_string(status));
  }
  return *std::move(simulator);
}

inline std::unique_ptr<simulation::Instance> instance_of(const Scene& scene, const BulletOptions& options = {}) {
  return simulator_of(scene, options)->make_instance(scene.actions, core::RandomStream(1, core::Purpose::kTest));
}

}  // namespace prescene::tests
