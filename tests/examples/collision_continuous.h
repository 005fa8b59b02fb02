// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of collision_continuous take for granted.
#pragma once

#include "prescene/collision/query_scratch.h"
#include "prescene/collision/triangle_tree.h"
#include "prescene/geometry/pose.h"

namespace prescene::collision::given_collision_continuous {

extern QueryScratch scratch;
extern const TriangleTree cup, table;
extern const geometry::Pose X_AB_start, X_AB_end;

}  // namespace prescene::collision::given_collision_continuous
