// SPDX-License-Identifier: Apache-2.0
// When calm objects are at rest. Every stepper asks the same:
//
// - stands firmly: an object that only fixed bodies and held objects touch is stable when the vertical through its
//   centre of mass passes inside the polygon of its contacts, farther from every side than a nudge tilts it
//   (stands_firmly()); no action is to come, so that what is held stays where it is;
// - creeps: what stands firmly and still moves at more than kCreepSpeed slides down a slope that hardly holds it;
// - balances: all others (on an edge or tip, round, leaning, stacked) are nudged: in a copy of the instance each is
//   turned by kNudge about kNudgeAxes horizontal axes in turn, and a simulation of nudge_window() shows whether it
//   comes back (or merely rolls), or turns away and sinks (topples()).
#pragma once

#include <span>

#include "prescene/geometry/polygon.h"
#include "prescene/geometry/pose.h"

namespace prescene::simulation {

/// m/s. A body that stands firmly, calm for the rest rule's time, and still faster is sliding.
inline constexpr double kCreepSpeed = 1e-3;
/// rad. A body that half a degree topples is not at rest: tables shake more.
inline constexpr double kNudge = 0.0087;
inline constexpr int kNudgeAxes = 4;

/// `contacts`: where an object is borne, as seen from its centre of mass along gravity, m, in any order; they are
/// sorted. `height`, m, is that of the centre of mass above the lowest contact. `corners` has room for twice as many.
bool stands_firmly(std::span<geometry::Vector2d> contacts, double height, std::span<geometry::Vector2d> corners);

/// Axis of the k-th nudge, between a body's likely edges: 22.5, 112.5, 202.5 and 292.5 degrees about `down` (unit).
geometry::Vector3d nudge_axis(const geometry::Vector3d& down, int k);

/// Seconds in which a nudged body with its centre of mass at `height` (m) shows what becomes of it; gravity in m/s^2.
double nudge_window(double height, double gravity);

/// Whether a body topples: `drop` (m) is what its centre of mass sank, `turn` the rotation vector of its turn since
/// before the nudge, `height` as above, then.
bool topples(double drop, double height, const geometry::Vector3d& turn, const geometry::Vector3d& down);
/// False where no turn could make topples() true: spares working one out.
bool may_topple(double drop, double height);

}  // namespace prescene::simulation
