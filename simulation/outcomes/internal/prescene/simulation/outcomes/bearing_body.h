// SPDX-License-Identifier: Apache-2.0
// What of an object holds planes off, where spheres stand for its surface: planes meet spheres, which lie up to their
// edge fidelity inside of edges and corners and rise a little over round surfaces.
//
// The centre of mass of an object on a plane is at least as high above it as a polytope inside of what bears reaches
// down; so heights that the polytope can't be turned over at bind the object too.
#pragma once

#include <optional>

#include "prescene/belief/object_model.h"
#include "prescene/simulation/convex_polytope.h"
#include "prescene/simulation/shape_store.h"

namespace prescene::simulation {

struct BearingBody {
  ConvexPolytope polytope;  ///< In O: planes are held off at least as far as this holds them off.
  double rise = 0.0;        ///< By which spheres leave the hull at most, m.
  /// Of a ball about the centre of mass that no other surface enters, m; 0 = none known.
  double inner_radius = 0.0;
};

/// `hull` is that of all `shapes`, in O. The polytope is the hull with its faces moved inwards, as little as will do.
/// Nothing when that is more than a millimetre (times `length_scale`, which is Simulator::length_scale()), or the
/// spheres can't be made.
std::optional<BearingBody> bearing_body(const std::vector<belief::CollisionShape>& shapes, const ConvexPolytope& hull,
                                        const Vector3d& center_of_mass_O, ShapeStore& store, double length_scale = 1.0);

}  // namespace prescene::simulation
