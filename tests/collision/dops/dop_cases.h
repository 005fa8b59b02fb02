// SPDX-License-Identifier: Apache-2.0
// Pairs of meshes and poses on which all trees of k-DOPs and boxes must agree with trying every pair of triangles.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "prescene/collision/mesh.h"
#include "prescene/collision/transform.h"

namespace prescene::collision {

struct PosedPair {
  Transform X_AB;
  bool collides = false;  ///< By brute force.
};

struct DopCase {
  std::string name;
  std::shared_ptr<const Mesh> a;
  std::shared_ptr<const Mesh> b;
  std::vector<PosedPair> poses;  ///< Scattered, and on the verge of contact.
};

/// Smooth and ragged shapes, degenerate and single triangles, far from the origin, huge and tiny ones.
const std::vector<DopCase>& dop_cases();

}  // namespace prescene::collision
