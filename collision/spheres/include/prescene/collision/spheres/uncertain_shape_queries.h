// SPDX-License-Identifier: Apache-2.0
// A packed body and a static shape whose poses are Gaussian: does the body touch the shape, how probable is it, and
// with what force. The queries of uncertain_sphere_queries.h.
//
//   PRESCENE_TRY(const RelativeUncertainty between, RelativeUncertainty::make({X_WC, C_C}, {X_WT}));  // carton, table
//   UncertainScratch scratch;
//   const UncertainOverlap overlap = uncertain_overlap(carton, table, between, scratch);
//   const UncertainWrench wrench = uncertain_wrench(carton, table, between, {.stiffness = 1e4}, scratch);
//
// The distance of a sphere from the shape changes by at most as much as its centre moves, and with a half-space by just
// its part along the normal. So bounds rest on distances alone; they hold for every shape, also for large rotations.
#pragma once

#include "prescene/collision/spheres/relative_uncertainty.h"
#include "prescene/collision/spheres/sphere_tree.h"
#include "prescene/collision/spheres/static_shape.h"
#include "prescene/collision/spheres/uncertain_sphere_queries.h"

namespace prescene::collision {

/// Whether they touch. The descent keeps the 64 spheres that the shortest errors bring to the shape, `critical_pairs`,
/// and ends at the first that touches for certain. `state` is kNone or kCertain where a bound says so with the
/// confidence of `between`.
/// Lower bound: the most probable sphere touches the face that it is nearest to, as far as that is known to reach (for
/// a half-space, its probability in closed form), a ball that lies behind that, or just the nearest place: of a height
/// field and of a surface that is not flat that says little where the error along it is as large as the sphere.
/// Upper bound, the least of: no error shorter than the critical one makes the bodies touch; the sum over all spheres,
/// each by its margin along the normal for convex shapes and in any direction for others; a plane before the shape (for
/// shapes that are not convex: what of it the body may reach) is crossed at one of four points [Worsley 1982].
/// Estimate: 32 lines through the space of errors (line sampling [Koutsourelakis et al. 2004]) with the shape flat at
/// its place nearest to each sphere, and solid behind it. Unless the shape is a half-space or the bounds are close, 256
/// poses are drawn, too: they replace the estimate where they contradict it, and else widen its error.
UncertainOverlap uncertain_overlap(const SphereTree& a, const StaticShape& b, const RelativeUncertainty& between,
                                   UncertainScratch& scratch);

/// Mean and covariance of penalty_wrench(): the force on A and its torque, in A's frame. Moments to
/// second order in the error, with the kink where contact begins taken in full, of a shape that is flat at its place
/// nearest to each sphere: good for half-spaces, and where the normal changes little over the error.
UncertainWrench uncertain_wrench(const SphereTree& a, const StaticShape& b, const RelativeUncertainty& between,
                                 const PenaltyOptions& options, UncertainScratch& scratch);

}  // namespace prescene::collision
