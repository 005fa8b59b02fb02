// SPDX-License-Identifier: Apache-2.0
// JSON of what a belief learned of physical parameters and of what it learns from, both ways.
#pragma once

#include "json_reader.h"
#include "prescene/belief/motion_record.h"
#include "prescene/belief/physical_belief.h"

namespace prescene::belief {

/// Of a belief that has learned something.
Json physics_json(const PhysicalBelief& physics);
/// `dimensions`: of the parameters of the object's model.
PhysicalBelief physics_from(const JsonAt& at, int dimensions);
Json motion_json(const MotionRecord& motion);
MotionRecord motion_from(const JsonAt& at);
Json grip_json(const GripRecord& grip);
GripRecord grip_from(const JsonAt& at);

}  // namespace prescene::belief
