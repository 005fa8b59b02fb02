// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of collision/dops take for granted.
#pragma once

#include <memory>

#include "prescene/collision/dops/boxtree.h"
#include "prescene/collision/dops/bvhlite_tree.h"
#include "prescene/collision/dops/dop_tree.h"
#include "prescene/collision/dops/simdop_tree.h"
#include "prescene/collision/mesh.h"
#include "prescene/collision/transform.h"
#include "prescene/core/parallel.h"

namespace prescene::collision::given_collision_dops {

extern core::ThreadPool pool;
extern const std::shared_ptr<const Mesh> mesh;
extern const Transform X_CT;

namespace boxtree_h {
extern const Boxtree table;
}
namespace bvhlite_tree_h {
extern const BvhLiteTree table;
}
namespace dop_tree_h {
extern const DopTree table;
}
namespace simdop_tree_h {
extern const SimdopTree table;
}

}  // namespace prescene::collision::given_collision_dops
