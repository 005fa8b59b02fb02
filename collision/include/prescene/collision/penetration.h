// SPDX-License-Identifier: Apache-2.0
// How deep two solids overlap: the length of the shortest translation that takes them apart, between bounds.
//
//   PenetrationScratch scratch;                                       // one a thread, kept
//   if (const auto overlap = penetration(cup, table, X_CT, {}, scratch)) {
//     ... overlap->depth, overlap->direction, overlap->X_AB_apart
//   }
//
// The upper bound is a translation that was tried: with it, `collide` is false and neither body is inside the other.
// It is found among directions given by the bodies, their boxes and their contact, each followed to where the bodies
// come apart; then it is projected onto the tangent of the contact that it leads to, until that does not help any more
// [Je et al. 2012], and turned a little in all directions. So it is the least of a neighbourhood, not of all
// directions; for bodies that are not convex a shorter one may exist.
//
// The lower bound: where a ball of radius r about a point is inside of A and one of radius s inside of B, no
// translation shorter than r + s takes A and B apart.
//
// Bodies are solids: closed meshes whose triangles are counter-clockwise seen from outside. For other meshes the upper
// bound takes the surfaces apart all the same, but whether one is inside the other, and the lower bound, mean nothing.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "prescene/collision/query_scratch.h"
#include "prescene/collision/transform.h"
#include "prescene/collision/triangle_queries.h"
#include "prescene/collision/triangle_tree.h"

namespace prescene::collision {

struct PenetrationOptions {
  /// How far along its direction the translation may go on after the bodies have come apart, as a share of its length.
  /// Less than 1e-6 or not a number counts as 1e-6, more than 1 as 1.
  double tolerance = 1e-3;
};

struct Penetration {
  double depth = 0.0;  ///< Moving B by depth times direction takes the bodies apart, m.
  double least = 0.0;  ///< No translation shorter than this does, m; zero when nothing is known.
  Eigen::Vector3d direction = Eigen::Vector3d::UnitX();  ///< In A's frame, unit length.
  Transform X_AB_apart;                                  ///< X_AB moved so: neither collides nor is one in the other.
  /// Nearest points of the bodies when they have come apart, put back: p_A is on A, p_B on B, and p_B is about as far
  /// behind p_A along the direction as the overlap is deep. In A's frame, m.
  Eigen::Vector3d p_A = Eigen::Vector3d::Zero();
  Eigen::Vector3d p_B = Eigen::Vector3d::Zero();
};

/// Memory of penetration queries; after the first ones nothing is allocated any more.
class PenetrationScratch {
 public:
  PenetrationScratch();
  QueryScratch& queries() { return queries_; }
  std::vector<TrianglePair>& pairs() { return pairs_; }
  /// The origin as a body.
  const TriangleTree& point() const { return point_; }

 private:
  QueryScratch queries_;
  std::vector<TrianglePair> pairs_;
  TriangleTree point_;
};

/// Nothing when the solids have no point in common. Some dozens of collision queries, a few hundred microseconds, and
/// after each that finds no contact up to three rays for every piece of one body that reaches into the other's box.
/// `counts`, where given, is added to.
std::optional<Penetration> penetration(const TriangleTree& a, const TriangleTree& b, const Transform& X_AB,
                                       const PenetrationOptions& options, PenetrationScratch& scratch,
                                       QueryCounts* counts = nullptr);

}  // namespace prescene::collision
