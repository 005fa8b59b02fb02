// SPDX-License-Identifier: Apache-2.0
// Where rays hit a body. Rays are given in the frame of the body's mesh; `in_frame` brings them there.
//
//   QueryScratch scratch;                                                // one a thread, kept
//   if (const auto hit = nearest_hit(cup, in_frame(X_CW, ray), scratch)) ... hit->t  // p = origin + t direction
//   nearest_hits(cup, rays_of_a_depth_image, hits, scratch);             // rays that go together are faster together
//
// Both sides of triangles count, and so do edges, corners and the ends of the range of t. Which triangles are hit is
// decided by `meet` of ray_triangle.h in double precision, for each of them alone: the tree leaves out none that it
// would hit, and instruction sets and packets change no bit. No ray passes between two triangles that share an edge.
// A ray that starts on a triangle hits it at t_min = 0 where rounding its origin to double precision leaves it there.
// A ray that is not in order (NaN, no direction: see `shear`) hits nothing.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "prescene/collision/query_scratch.h"
#include "prescene/collision/ray_triangle.h"
#include "prescene/collision/transform.h"
#include "prescene/collision/triangle_tree.h"

namespace prescene::collision {

struct RayHit {
  double t = 0.0;  ///< Along the ray, in lengths of its direction; off by a few 1e-16 of the coordinates' size.
  std::array<double, 3> weights = {0, 0, 0};  ///< Of the triangle's corners (barycentric); their sum is 1.
  std::uint32_t triangle = kNoTriangle;       ///< In the mesh.
  bool front = false;                         ///< On the side from which the corners go round counter-clockwise.

  friend bool operator==(const RayHit&, const RayHit&) = default;
};

/// `ray_B` in frame A, computed in double precision.
Ray in_frame(const Transform& X_AB, const Ray& ray_B);

/// The hit with the smallest t; of several triangles there, such as on an edge, the one with the smallest index.
std::optional<RayHit> nearest_hit(const TriangleTree& tree, const Ray& ray, QueryScratch& scratch,
                                  QueryCounts* counts = nullptr);
/// Whether there is a hit at all.
bool any_hit(const TriangleTree& tree, const Ray& ray, QueryScratch& scratch, QueryCounts* counts = nullptr);

/// The same for many rays, 16 at a time in the order given: faster where those 16 go about the same way. `hits` is as
/// long as `rays` (checked).
void nearest_hits(const TriangleTree& tree, std::span<const Ray> rays, std::span<std::optional<RayHit>> hits,
                  QueryScratch& scratch, QueryCounts* counts = nullptr);
void any_hits(const TriangleTree& tree, std::span<const Ray> rays, std::span<bool> hits, QueryScratch& scratch,
              QueryCounts* counts = nullptr);

}  // namespace prescene::collision
