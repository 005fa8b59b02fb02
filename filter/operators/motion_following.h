// SPDX-License-Identifier: Apache-2.0
// When an object lies still, starts to move, is let go, and lies still again: the episodes that are learned from.
#pragma once

#include "prescene/filter/operators/learn_physics.h"

namespace prescene::filter {

/// Brings the motion record of one object up to the belief's last frame; a new or ended episode is in the record.
void follow_motion(const belief::Belief& belief, int object, const LearnPhysicsOptions& options,
                   belief::MotionRecord& record);

}  // namespace prescene::filter
