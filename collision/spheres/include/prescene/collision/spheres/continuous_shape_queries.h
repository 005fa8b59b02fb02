// SPDX-License-Identifier: Apache-2.0
// When a packed body that moves touches a static shape first.
//
//   PRESCENE_TRY(const ScrewMotion motion, ScrewMotion::make(X_CT_start, X_CT_end));   // the table seen from the cup
//   SweepScratch scratch;
//   const std::optional<ShapeImpact> impact = time_of_impact(cup, table, motion, {}, scratch);
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>

#include "prescene/collision/screw_motion.h"
#include "prescene/collision/spheres/continuous_sphere_queries.h"
#include "prescene/collision/spheres/sphere_tree.h"
#include "prescene/collision/spheres/static_shape.h"
#include "prescene/collision/transform.h"

namespace prescene::collision {

struct ShapeImpact {
  double time = 0.0;         ///< In [0, 1]: 0 at the start, 1 at the end of the motion; 0 when they touch there.
  std::uint32_t sphere = 0;  ///< Index in the packing.
  Eigen::Vector3d point = Eigen::Vector3d::Zero();   ///< The sphere's that is nearest to the shape then, in A, m.
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< From the sphere to the shape, in A, of unit length.
};

/// Seen from B, A's spheres move along straight lines from where X_AB_start puts them to where X_AB_end does. Exact for
/// that motion up to rounding in double precision; it is a rigid one when B does not turn. Nothing for a transform that
/// is not finite (to_transform refuses those).
std::optional<ShapeImpact> time_of_impact(const SphereTree& a, const StaticShape& b, const Transform& X_AB_start,
                                          const Transform& X_AB_end, SweepScratch& scratch);

/// B moves along a screw, as seen from A; the screw of A as seen from B is its inverse. The time is never later than
/// the first contact, and then the gap is at most the tolerance: spheres that turn are taken to move along chords of
/// their paths, larger by what they leave them by. Misses nothing: a motion without contact that passes within the
/// tolerance may be reported.
std::optional<ShapeImpact> time_of_impact(const SphereTree& a, const StaticShape& b, const ScrewMotion& motion,
                                          const ImpactOptions& options, SweepScratch& scratch);

}  // namespace prescene::collision
