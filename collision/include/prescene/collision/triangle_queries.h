// SPDX-License-Identifier: Apache-2.0
// Questions about two bodies, each a TriangleTree. X_AB places body B in the frame of body A; points are answered in
// A's frame. Every answer is exact for the triangles that result from rounding X_AB * p_BQ to single precision (see
// transform.h); touching counts as colliding.
//
//   QueryScratch scratch;                       // one a thread, kept
//   if (collide(cup, table, X_CT, scratch)) ...
//
// No query allocates once its scratch has grown, and none fails: what could be wrong was refused when the mesh and the
// transform were made.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "prescene/collision/query_scratch.h"
#include "prescene/collision/transform.h"
#include "prescene/collision/triangle_tree.h"

namespace prescene::collision {

/// Indices of triangles in the two meshes.
struct TrianglePair {
  std::uint32_t a = kNoTriangle;
  std::uint32_t b = kNoTriangle;
  friend auto operator<=>(const TrianglePair&, const TrianglePair&) = default;
};

/// Whether a triangle of A and a triangle of B have a point in common. `counts`, where given, is added to.
bool collide(const TriangleTree& a, const TriangleTree& b, const Transform& X_AB, QueryScratch& scratch,
             QueryCounts* counts = nullptr);

/// The first such pair that is met; which one of several is not promised.
std::optional<TrianglePair> first_pair(const TriangleTree& a, const TriangleTree& b, const Transform& X_AB,
                                       QueryScratch& scratch, QueryCounts* counts = nullptr);

/// All such pairs, appended to `pairs` in no promised order, at most `limit`. Returns whether these are all.
bool all_pairs(const TriangleTree& a, const TriangleTree& b, const Transform& X_AB, std::size_t limit,
               std::vector<TrianglePair>* pairs, QueryScratch& scratch, QueryCounts* counts = nullptr);

}  // namespace prescene::collision
