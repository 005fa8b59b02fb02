// SPDX-License-Identifier: Apache-2.0
// Where every stepper splits a step: at impacts. A body that turns by a third of a radian in a step hits with another
// corner, at another time and about another arm than the one it has when the step begins; and where it hits with two
// corners, the second one hits with the speed that the first one gave it. Errors of both kinds are as large as the step
// is long. So a step goes on to the first impact, without it; then follows a part that is hardly longer than the impact
// itself, for which all contacts are found anew; then what is left, in the same way. Impacts become as exact as in
// steps of that part's length, and flights, slides and rest keep theirs.
//
//   int left = kStepParts;
//   for (int splits = 0; left > 0; ++splits) {
//     double first = split_time({.gap = 1e-4, .speed = -0.5, .acceleration = -9.8, .reach = 0.06}, options);
//     left -= splits < most_splits(1) ? parts_until(first, options.step, left) : left;
//   }
//
// What hands move goes on in every part as it does in the whole step, and contacts count its velocity. While a hand of
// limited force drives something nothing is split: it does what the whole step takes.
//
// The second thing that splits a step is a rim that rolls. A round body that leans on its rim touches with one point,
// which may run round the rim far faster than the body turns. The points beside it are contacts, too, and where a step
// rolls over them they take energy as if they hit.
#pragma once

#include "prescene/geometry/pose.h"
#include "prescene/simulation/rules/mechanics_options.h"

namespace prescene::simulation {

/// Of a step: an impact takes one.
inline constexpr int kStepParts = 64;
/// Impacts split a step if the two close, in a whole step, by at least this share of the object's farthest point. Slow
/// ones matter for what rocks: with 0.02, a bottle on its rim comes to stand too often
/// (docs/studies/uncertain_physics.md).
inline constexpr double kSplitTravel = 0.0005;

/// A contact that may close within a step.
struct Approach {
  double gap = 0.0;           ///< m; negative where the two overlap.
  double speed = 0.0;         ///< m/s along the normal, before the step's gravity; negative while it closes.
  double acceleration = 0.0;  ///< m/s^2 along the normal: by what the two fall differently.
  double reach = 0.0;         ///< m: of the object's farthest point from its frame.
};

/// When the contact closes, s from now on, if that splits the step; else infinity. Contacts that are slower than
/// `restitution_speed` do not hit. What overlaps by more than `touching_distance` is jammed and gets one impulse a
/// step: many that are not settled would add energy.
double split_time(const Approach& approach, const MechanicsOptions& options);

/// A part of a step ends at the latest when the point that touches has gone on by so much along a rim, rad. At 0.2 a
/// wobbling cylinder still loses half of its energy to points of the rim that it rolls over
/// (docs/studies/uncertain_physics.md).
inline constexpr double kSplitRoll = 0.1;

/// A rim that leans on something flat; all in the same frame.
struct LeaningRim {
  geometry::Vector3d axis;    ///< Unit: of the rim.
  geometry::Vector3d normal;  ///< Unit: of what is below, towards the rim.
  geometry::Vector3d spin;    ///< rad/s, as seen from what is below.
};
/// It touches with one point of the rim: neither flat with the cap nor with the side.
bool leans(const LeaningRim& rim);
/// The direction from the middle of a rim that leans to its lowest point; unit.
geometry::Vector3d lowest_of(const LeaningRim& rim);
/// How long the lowest point of a rim that leans takes to go on by kSplitRoll, s.
double roll_time(const LeaningRim& rim);

/// The two rims of a cylinder with rounded edges.
struct RimPair {
  geometry::Vector3d middle;  ///< m: the point of the axis from which `upper` and `lower` count; frame of the rim.
  double radius = 0.0;        ///< m: of the rims, without the rounding.
  double upper = 0.0;         ///< m: where the rim is to which the axis points.
  double lower = 0.0;         ///< m: where the other one is.
  double rounding = 0.0;      ///< m: the surface is so far outside of the rims.
};
/// The lowest point of a cylinder that leans on the lower of its two rims, in the rim's frame, m.
geometry::Vector3d lowest_of(const LeaningRim& rim, const RimPair& rims);
/// How long a contact takes to go on along the rim by kSplitRoll, s. Infinite if the cylinder does not lean, or leans
/// on another point than `point` (m, on its surface, in the rim's frame): they are farther apart than `tolerance` (m).
double roll_time(const LeaningRim& rim, const RimPair& rims, const geometry::Vector3d& point, double tolerance);

/// Whole parts of a step of `step` seconds that end before the first impact at `time`, at least one; `left`, those that
/// are not yet taken, if it comes after them.
int parts_until(double time, double step, int left);

/// Most splits of a step in which so many objects move freely; then what is left is taken at once, so that none takes
/// for ever. 16 for four objects or fewer. In a heap something hits in every step, and each split costs as much as a
/// step of all of it: there are 64 / objects, and none beyond 64 objects.
int most_splits(int objects);

}  // namespace prescene::simulation
