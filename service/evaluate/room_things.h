// SPDX-License-Identifier: Apache-2.0
// The things of simulated rooms: those of which there are models, and others.
#pragma once

#include <string>
#include <vector>

#include "prescene/belief/object_model.h"
#include "prescene/core/random.h"
#include "prescene/core/status.h"
#include "prescene/geometry/primitives.h"
#include "prescene/geometry/symmetry.h"
#include "prescene/geometry/triangle_mesh.h"

namespace prescene::service {

/// A thing to place, and the ways in which it can lie.
struct ThingKind {
  std::string name;
  geometry::TriangleMesh mesh;
  geometry::Primitive solid;  ///< Stands for it in simulations.
  std::vector<geometry::Quaterniond> lying;
  bool flat_top = false;  ///< Something may stand on it.
  geometry::SymmetryGroup symmetry{};
};

/// One of each that may be looked for.
std::vector<ThingKind> known_things();
/// Something nobody knows of: a box or a cylinder.
ThingKind unknown_thing(core::RandomStream& draws);
core::Result<belief::ObjectModel> model_of(const ThingKind& kind);

}  // namespace prescene::service
