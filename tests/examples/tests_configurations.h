// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of tests/support (configurations for collision queries) take for granted.
#pragma once

#include <cstdint>
#include <memory>

#include "prescene/collision/mesh.h"
#include "tests/support/contact_configurations.h"

namespace prescene::tests::given_tests_configurations {

using collision::Transform;

extern const std::shared_ptr<const collision::Mesh> mesh_a, mesh_b;
extern const PairOracle oracle;
extern const std::uint64_t seed;

}  // namespace prescene::tests::given_tests_configurations
