// SPDX-License-Identifier: Apache-2.0
// Pairs of triangles that make tests of intersection and distance fail: on a coarse grid, touching, almost touching,
// coplanar, needles, points, of very different sizes, and far from the origin.
#pragma once

#include <array>
#include <string_view>

#include "prescene/collision/exact_triangles.h"
#include "prescene/core/random.h"

namespace prescene::collision {

enum class Nastiness {
  kPlain,         ///< Corners uniform in a cube.
  kGrid,          ///< Coordinates 0, 1 or 2.
  kTouching,      ///< A corner of one rounded onto the other's face.
  kAlmost,        ///< The same, then moved by 1e-9 to 1e-4 of the size.
  kEdges,         ///< An edge of one through a rounded point of the other's edge.
  kNeedle,        ///< One or both 1e-3 to 1e-8 as wide as long.
  kSharedCorner,  ///< As neighbours in a mesh.
  kSharedEdge,
  kCoplanar,    ///< In a plane along two axes or rounded onto a tilted one.
  kMixedScale,  ///< One of size 1e-30 to 1 beside one of size 1.
  kDegenerate,  ///< Segments, points and repeated corners.
  kDenormal,    ///< Sizes about 1e-44 to 1e-38.
  kFar,         ///< Small, 1 to 1e8 from the origin.
  kHuge,        ///< Up to kLargestCoordinate, with small ones.
  kGridScaled,  ///< A grid whose axes have powers of two of their own as steps.
};
inline constexpr std::array<Nastiness, 15> kAllNastiness = {
    Nastiness::kPlain,    Nastiness::kGrid,       Nastiness::kTouching,     Nastiness::kAlmost,
    Nastiness::kEdges,    Nastiness::kNeedle,     Nastiness::kSharedCorner, Nastiness::kSharedEdge,
    Nastiness::kCoplanar, Nastiness::kMixedScale, Nastiness::kDegenerate,   Nastiness::kDenormal,
    Nastiness::kFar,      Nastiness::kHuge,       Nastiness::kGridScaled};
std::string_view to_string(Nastiness nastiness);

struct NastyPair {
  Triangle a;
  Triangle b;
};
NastyPair nasty_pair(Nastiness nastiness, core::RandomStream& random);

}  // namespace prescene::collision
