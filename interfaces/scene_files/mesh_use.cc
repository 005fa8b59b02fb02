// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/scene_files/mesh_use.h"

#include <algorithm>

#include "prescene/core/check.h"
#include "prescene/geometry/mass_properties.h"

namespace prescene::interfaces {

using belief::MeshUse;

const std::vector<std::pair<std::string, MeshUse>>& mesh_uses() {
  static const std::vector<std::pair<std::string, MeshUse>> kUses{{"convex_hull", MeshUse::kConvexHull},
                                                                  {"convex_parts", MeshUse::kConvexParts},
                                                                  {"decompose", MeshUse::kDecompose},
                                                                  {"surface", MeshUse::kSurface},
                                                                  {"spheres", MeshUse::kSpheres}};
  return kUses;
}

const std::string& word_of(MeshUse use) {
  const auto found = std::ranges::find(mesh_uses(), use, &std::pair<std::string, MeshUse>::second);
  PRESCENE_CHECK(found != mesh_uses().end());
  return found->first;
}

std::optional<double> hidden_hollow(const belief::MeshShape& shape) {
  if (shape.use != MeshUse::kConvexHull && shape.use != MeshUse::kConvexParts) return std::nullopt;
  const auto solid = geometry::mass_properties(*shape.mesh, 1.0);
  if (!solid) return std::nullopt;
  const auto filled = belief::mass_properties(shape, 1.0);
  if (!filled) return std::nullopt;
  return std::max(0.0, 1.0 - solid->mass / filled->mass);
}

}  // namespace prescene::interfaces
