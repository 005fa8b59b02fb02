// SPDX-License-Identifier: Apache-2.0
// Bounds of the probability that two bodies with uncertain poses touch, from the pairs of spheres that may touch first.
#pragma once

#include <Eigen/Core>

#include "prescene/collision/spheres/relative_uncertainty.h"
#include "prescene/collision/spheres/sphere_tree.h"
#include "uncertain_lanes.h"

namespace prescene::collision {

/// In A's frame, m.
struct CriticalPair {
  Eigen::Vector3d a = Eigen::Vector3d::Zero();  ///< Centres.
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  double radii = 0.0;

  /// From a to b; along x when they are at one place.
  Eigen::Vector3d normal() const;
};
CriticalPair pair_at(const CriticalPairs& pairs, std::size_t i);

class ContactBounds {
 public:
  /// Looks at the arguments during construction only.
  ContactBounds(const SphereTree& a, const SphereTree& b, const RelativeUncertainty& between,
                const CriticalPairs& critical);

  /// Of an error outside the region, or of one that remainder() does not bound: the upper bound when no pair may touch.
  static double outside(const RelativeUncertainty& between) {
    return 1.0 - between.confidence() + RelativeUncertainty::kRemainderFails;
  }

  double lower() const { return lower_; }
  double upper() const { return upper_; }
  /// The pair with the least margin, if there is one.
  const CriticalPair& leader() const { return leader_; }

 private:
  double lower_ = 0.0;
  double upper_ = 1.0;
  CriticalPair leader_;
};

/// Bound of how far the spheres reach: max over them of direction . centre + radius, in the tree's frame, m. Not more
/// than `tolerance` too large unless the descent takes more than 64 nodes. `direction` is of unit length.
double reach_along(const SphereTree& tree, const Eigen::Vector3d& direction, double tolerance);

}  // namespace prescene::collision
