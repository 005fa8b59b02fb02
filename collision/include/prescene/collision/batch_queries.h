// SPDX-License-Identifier: Apache-2.0
// Whether two bodies touch, for many configurations of them at once. Exact as the single query (triangle_queries.h).
//
//   std::array<bool, 2> touching;
//   collide(cup, table, std::array{X_CT, X_CT}, touching, scratch);
#pragma once

#include <span>

#include "prescene/collision/query_scratch.h"
#include "prescene/collision/transform.h"
#include "prescene/collision/triangle_tree.h"

namespace prescene::collision {

/// Whether a triangle of A and a triangle of B have a point in common: touching[i] for X_AB[i] (of one length,
/// checked). Taken sixteen at a time in the order given: the nearer to each other these are, the more of the work they
/// share. Within 1 % of the size and 1 degree that is most of it; far apart, single queries are faster.
void collide(const TriangleTree& a, const TriangleTree& b, std::span<const Transform> X_AB, std::span<bool> touching,
             QueryScratch& scratch, QueryCounts* counts = nullptr);

}  // namespace prescene::collision
