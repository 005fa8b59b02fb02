// SPDX-License-Identifier: Apache-2.0
// How far apart two bodies are, each a TriangleTree, and whether they are within a distance. X_AB places body B in the
// frame of body A; points are answered in A's frame. As for all queries, the triangles are those that result from
// rounding X_AB * p_BQ to single precision (transform.h).
//
//   QueryScratch scratch;                       // one a thread, kept
//   const auto gap = distance(cup, table, X_CT, {.limit = 0.1}, scratch);
//   if (gap) ... gap->distance, gap->p_A, gap->p_B
//
// No query allocates once its scratch has grown, and none fails.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <optional>

#include "prescene/collision/query_scratch.h"
#include "prescene/collision/transform.h"
#include "prescene/collision/triangle_queries.h"
#include "prescene/collision/triangle_tree.h"

namespace prescene::collision {

struct DistanceOptions {
  /// The answer is at most the larger of the two above the least distance, besides rounding. Negative or not a number:
  /// zero.
  double relative_tolerance = 0.0;  ///< Times the answer.
  double absolute_tolerance = 0.0;  ///< m
  /// Whether anything is nearer than this, m, is all that is asked; the nearer, the faster. Not a number: no limit.
  double limit = std::numeric_limits<double>::infinity();
  /// Two triangles that are known to be near, as the answer a moment ago; makes a query faster. Triangles that the
  /// meshes do not have are ignored.
  TrianglePair seed = {};
};

struct Distance {
  double distance = 0.0;                          ///< m. Zero exactly where the bodies collide.
  Eigen::Vector3d p_A = Eigen::Vector3d::Zero();  ///< The nearest point of A (p_AP), m.
  Eigen::Vector3d p_B = Eigen::Vector3d::Zero();  ///< That of B, in A's frame too; p_A where they collide.
  TrianglePair triangles;                         ///< On which they are.
};

/// The least distance of a point of A from one of B; nothing where that is more than the limit. Zero, with triangles
/// that intersect, exactly where `collide` says so, whatever the tolerances. The points and their distance are computed
/// in double precision, from the pair of triangles that is the nearest in single precision: beyond the tolerance, the
/// answer is at most 2^-19 of the size of the box about two triangles that far apart, and 1e-18 m, above the least
/// distance, and it is never below it. Which of several pairs within that is answered is not promised.
std::optional<Distance> distance(const TriangleTree& a, const TriangleTree& b, const Transform& X_AB,
                                 const DistanceOptions& options, QueryScratch& scratch, QueryCounts* counts = nullptr);

/// Whether a point of A is within `margin`, m, of one of B: whether distance() is at most that, decided in double
/// precision. Faster than a distance: ends with the first such pair.
bool within_distance(const TriangleTree& a, const TriangleTree& b, const Transform& X_AB, double margin,
                     QueryScratch& scratch, QueryCounts* counts = nullptr);

}  // namespace prescene::collision
