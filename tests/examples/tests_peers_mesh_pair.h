// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of tests/peers/mesh_collision.h take for granted.
#pragma once

#include "tests/peers/mesh_collision.h"

namespace prescene::tests::given_tests_peers_mesh_pair {

extern const CollisionMesh mesh_a, mesh_b;
extern const collision::Transform X_AB;

}  // namespace prescene::tests::given_tests_peers_mesh_pair
