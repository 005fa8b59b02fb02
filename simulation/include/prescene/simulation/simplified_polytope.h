// SPDX-License-Identifier: Apache-2.0
// Hulls of scanned meshes have thousands of vertices; contacts need few. The simplified hull is that of some of the
// vertices: it lies inside the given one, rests on the same faces, and says how far it stays behind.
//
//   PRESCENE_TRY(const SimplifiedPolytope few, simplified(hull, PolytopeLimits{}));
//   if (few.error > 1e-3) ...
#pragma once

#include <cstddef>

#include "prescene/simulation/convex_polytope.h"

namespace prescene::simulation {

/// Those of the lockstep stepper by default.
struct PolytopeLimits {
  std::size_t vertices = 64;  ///< >= 16
  std::size_t corners = 16;   ///< Of a face; >= 4.
  friend bool operator==(const PolytopeLimits&, const PolytopeLimits&) = default;
};

struct SimplifiedPolytope {
  ConvexPolytope polytope;
  /// m: the largest height of a vertex of the given polytope above a face plane of this one.
  double error = 0.0;
};

bool within(const ConvexPolytope& polytope, const PolytopeLimits& limits);

/// The polytope itself if it is within the limits. Else it is built up from its extreme vertices and some of the
/// largest face on which a body of uniform density would rest: the vertex that is farthest outside is added, corners of
/// such faces first, until the limit is reached. Fails with kInvalidInput when what remains has no thickness.
core::Result<SimplifiedPolytope> simplified(const ConvexPolytope& polytope, const PolytopeLimits& limits);

/// A polytope within the limits around which a ball of `radius` (m) sweeps about the given one: its faces stay where
/// they are and its edges are round. `radius` shrinks to what fits, to 0 where none does.
struct RoundedPolytope {
  ConvexPolytope core;
  double radius = 0.0;
  double error = 0.0;  ///< As of SimplifiedPolytope.
};
core::Result<RoundedPolytope> rounded(const ConvexPolytope& polytope, double radius, const PolytopeLimits& limits);

}  // namespace prescene::simulation
