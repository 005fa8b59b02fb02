// SPDX-License-Identifier: Apache-2.0
// Packed bodies against static shapes: the queries of sphere_queries.h where they make sense. A's centres are put into
// the shape's frame in double precision; a sphere overlaps when the shape's distance from its centre is at most its
// radius. Spheres that touch overlap.
//
//   PRESCENE_TRY(const HalfSpace table, HalfSpace::make({0, 0, 1}, 0.72));
//   const PenaltyWrench push = penalty_wrench(cup, table, X_CW, {.stiffness = 1000.0}, scratch);
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "prescene/collision/spheres/sphere_queries.h"
#include "prescene/collision/spheres/static_shape.h"

namespace prescene::collision {

bool overlap(const SphereTree& a, const StaticShape& b, const Transform& X_AB, SphereScratch& scratch);

struct ShapeDistance {
  double distance = 0.0;     ///< m; negative by the depth of the sphere when it overlaps.
  std::uint32_t sphere = 0;  ///< The nearest or deepest: index into the packing.
};
/// The smallest distance of a sphere from the shape, less than `below` (m), or nothing. An upper bound of the body's.
std::optional<ShapeDistance> distance(const SphereTree& a, const StaticShape& b, const Transform& X_AB,
                                      SphereScratch& scratch, double below = std::numeric_limits<double>::infinity());

/// The sum, over the spheres that overlap, of the volume of the sphere's part behind the plane that touches the surface
/// at the place nearest to its centre, m^3; `pairs` counts these spheres. For a half-space that is the volume that the
/// packing shares with it. For a convex solid (a primitive) it is at least that volume, as the solid lies behind each
/// of these planes, and more than it where spheres are large against the solid's curvature or reach over its edges: at
/// most the volume of the spheres whose centres are outside, and of those inside that are not wholly in it. For other
/// solids it may be more or less, by as much. A sheet has no inside: of it, this is the volume that spheres reach
/// through it.
SphereOverlap overlap_volume(const SphereTree& a, const StaticShape& b, const Transform& X_AB, SphereScratch& scratch);

/// A sphere that overlaps the shape. In A's frame.
struct ShapeContact {
  Vector3f position;  ///< In the middle of the overlap, m.
  Vector3f normal;    ///< From A into the shape, of unit length: A is pushed the other way.
  float depth;        ///< How far the sphere has to be moved to be free of the surface there, m.
  float volume;  ///< Of the sphere's part behind the plane that touches the surface at the nearest place, m^3: exact
                 ///< for half-spaces.
  std::uint32_t sphere;  ///< Index into the packing.
};
/// All spheres that overlap the shape, appended to `contacts`, at most `limit`. Returns whether these are all.
bool contacts(const SphereTree& a, const StaticShape& b, const Transform& X_AB, std::size_t limit,
              std::vector<ShapeContact>* contacts, SphereScratch& scratch);

/// Each sphere that overlaps is pushed with stiffness * depth / 2 along its normal, as by the packing of a body of the
/// same stiffness.
PenaltyWrench penalty_wrench(const SphereTree& a, const StaticShape& b, const Transform& X_AB,
                             const PenaltyOptions& options, SphereScratch& scratch);

}  // namespace prescene::collision
