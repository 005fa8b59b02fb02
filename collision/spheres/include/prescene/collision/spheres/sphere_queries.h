// SPDX-License-Identifier: Apache-2.0
// What two packings of spheres do to each other: whether and how far they overlap, how far apart they are, and the
// force that drives them apart [Weller and Zachmann 2011].
//
//   SphereScratch scratch;                                       // reused: queries then don't allocate
//   if (overlap(cup, table, X_CT, scratch)) ...
//   const PenaltyWrench push = penalty_wrench(cup, table, X_CT, {.stiffness = 1000.0}, scratch);
//
// A query puts B's centres into A's frame by `X_AB * p_BC` (transform.h) and answers for the spheres that result, with
// squared distances summed as (x^2 + y^2) + z^2 and compared with the rounded square of the rounded sum of the radii.
// Spheres that touch overlap. Bounding spheres are tested with slack for all roundings, so every tree over the same
// spheres gives the same answer. As packings lie inside their bodies, bodies may touch where packings don't yet.
//
// Trees of the same branching are met with vector instructions, the best that the processor has; others, and all by the
// functions of scalar_sphere_queries.h, one child at a time.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "prescene/collision/spheres/sphere_tree.h"
#include "prescene/collision/transform.h"

namespace prescene::collision {

/// Working memory of the queries, of one thread at a time.
class SphereScratch {
 public:
  struct NodePair {
    std::uint32_t a;
    std::uint32_t b;
    PackedSphere sphere_a;  ///< Bounding spheres in A's frame.
    PackedSphere sphere_b;
    float bound;  ///< Lower bound of the distance, for distance queries.
  };
  std::vector<NodePair> pairs;
  std::vector<std::uint32_t> nodes_a;  ///< Pairs of nodes, and those of the level below.
  std::vector<std::uint32_t> nodes_b;
  std::vector<std::uint32_t> next_a;
  std::vector<std::uint32_t> next_b;
  std::vector<float> gathered;
};

/// Whether a sphere of A and a sphere of B have a point in common.
bool overlap(const SphereTree& a, const SphereTree& b, const Transform& X_AB, SphereScratch& scratch);

/// Indices into the packings.
struct SpherePair {
  std::uint32_t a = 0;
  std::uint32_t b = 0;
  friend auto operator<=>(const SpherePair&, const SpherePair&) = default;
};

struct SphereDistance {
  double distance = 0.0;  ///< m; negative by the depth of the pair when the packings overlap.
  SpherePair pair;        ///< The nearest, or, when the packings overlap, the deepest pair.
};
/// The smallest distance of a sphere of A from one of B, less than `below` (m), or nothing. It is an upper bound of the
/// bodies' distance. Among pairs whose distances agree within rounding, which one is found is not promised. `seed`,
/// such as the pair of the last answer, speeds up coherent motion; a pair that is not there is left out of account.
std::optional<SphereDistance> distance(const SphereTree& a, const SphereTree& b, const Transform& X_AB,
                                       SphereScratch& scratch, double below = std::numeric_limits<double>::infinity(),
                                       std::optional<SpherePair> seed = std::nullopt);

struct SphereOverlap {
  double volume = 0.0;      ///< Sum of the volumes of the pairs' intersections, m^3.
  std::uint64_t pairs = 0;  ///< Of spheres that overlap.
};
/// The volume that the packings share. As neither packing overlaps itself, it is at most that of either, and at most
/// the volume that the bodies share, which it tends to as the packings fill the bodies.
SphereOverlap overlap_volume(const SphereTree& a, const SphereTree& b, const Transform& X_AB, SphereScratch& scratch);

/// Two spheres that overlap. In A's frame.
struct SphereContact {
  Vector3f position;  ///< On the line of the centres, in the middle of the overlap, m.
  Vector3f normal;    ///< From A's centre to B's, of unit length: A is pushed the other way. Where the centres fall
                      ///< together, the normal of the anchor of A's sphere.
  float depth;        ///< How far the spheres have to be moved apart, m.
  float volume;       ///< Of the intersection, m^3.
  SpherePair pair;
};
/// All pairs of spheres that overlap, appended to `contacts` in an order that is the same for every instruction set, at
/// most `limit`. Returns whether these are all.
bool contacts(const SphereTree& a, const SphereTree& b, const Transform& X_AB, std::size_t limit,
              std::vector<SphereContact>* contacts, SphereScratch& scratch);

/// All pairs of spheres that are at most `range` (m, not negative) apart, appended to `pairs` in an order that is the
/// same for every instruction set. A pair whose distance agrees with the range within rounding may be there or not.
void near_pairs(const SphereTree& a, const SphereTree& b, const Transform& X_AB, double range,
                std::vector<SpherePair>* pairs, SphereScratch& scratch);

struct PenaltyOptions {
  double stiffness = 1.0;                          ///< N/m, finite and not negative.
  Eigen::Vector3d p_AP = Eigen::Vector3d::Zero();  ///< The torque is about this point, m; often the centre of mass.
};
/// What drives A out of B, in A's frame. B receives the opposite force, and the opposite torque about the same point.
struct PenaltyWrench {
  Eigen::Vector3d force = Eigen::Vector3d::Zero();   ///< N.
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();  ///< N m, about P.
  double energy = 0.0;                               ///< J; force and torque are its negative gradient in A's motion.
  std::uint64_t pairs = 0;                           ///< Of spheres that overlap.
};
/// Each pair of spheres that overlap pushes with stiffness * (r1 + r2 - d) / 2 along the line of its centres: springs
/// that share the overlap. A pair whose centres fall together has no direction and does not push.
PenaltyWrench penalty_wrench(const SphereTree& a, const SphereTree& b, const Transform& X_AB,
                             const PenaltyOptions& options, SphereScratch& scratch);

/// Volume of the intersection of two spheres whose centres are d apart, m^3.
double lens_volume(double radius_a, double radius_b, double d);

}  // namespace prescene::collision
