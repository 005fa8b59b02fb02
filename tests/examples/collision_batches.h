// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of collision_batches take for granted.
#pragma once

#include <array>
#include <memory>

#include "prescene/collision/query_scratch.h"
#include "prescene/collision/transform.h"
#include "prescene/collision/triangle_tree.h"
#include "prescene/geometry/pose.h"

namespace prescene::collision::given_collision_batches {

extern QueryScratch scratch;
extern const TriangleTree cup, table;
extern const Transform X_CT;
extern const geometry::Pose X_WC;

namespace body_set_h {
extern const std::shared_ptr<const TriangleTree> cup_tree;
extern const TriangleTree hand_tree;
extern const geometry::Pose X_WH;
}  // namespace body_set_h

}  // namespace prescene::collision::given_collision_batches
