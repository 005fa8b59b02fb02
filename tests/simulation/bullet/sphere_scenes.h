// SPDX-License-Identifier: Apache-2.0
// Things that collide as inner sphere trees.
#pragma once

#include <memory>
#include <string>

#include "bullet_scenes.h"
#include "prescene/geometry/primitives.h"
#include "tests/support/hollow_meshes.h"

namespace prescene::tests {

inline belief::MeshShape packed(const geometry::TriangleMesh& mesh, const belief::SphereSettings& settings = {}) {
  return {std::make_shared<const geometry::TriangleMesh>(mesh), Pose{}, belief::MeshUse::kSpheres, settings};
}

inline ObjectModel packed_model(const std::string& name, const geometry::TriangleMesh& mesh, double mass = 1.0,
                                const belief::SphereSettings& settings = {}) {
  return model_of(name, {packed(mesh, settings)}, mass);
}

}  // namespace prescene::tests
