// SPDX-License-Identifier: Apache-2.0
// When an object lies still, starts to move, is let go, and lies still again: the episodes that are learned from.
#pragma once

#include <vector>

#include "prescene/filter/operators/learn_physics.h"

namespace prescene::filter {

/// Brings the motion record of one object up to the belief's last frame; a new or ended episode is in the record.
void follow_motion(const belief::Belief& belief, int object, belief::MotionRecord& record);

/// An object has moved when it is further from where it lay than this, or turned further, and in either case by at
/// least three of its standard deviations. Chosen.
inline constexpr double kStartShift = 0.008;  // m
inline constexpr double kStartTurn = 0.09;    // rad

/// How an object lies is known better than before: it has not moved, though its pose changes. A motion that is being
/// recorded ends without a lesson.
void note_known_better(const Pose& X_WO, belief::MotionRecord& record);

/// A body that is seen at each frame starts and stops between frames. Where its velocity changes, the interval gets the
/// corner at which the straight motions before and after it meet: joining the frames by straight lines would let a
/// pusher brake for a frame's length, and what it pushes leave it too early.
std::vector<belief::KinematicBody::Waypoint> with_corners(const std::vector<belief::KinematicBody::Waypoint>& seen);

}  // namespace prescene::filter
