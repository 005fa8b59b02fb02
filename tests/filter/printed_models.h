// SPDX-License-Identifier: Apache-2.0
// Models with a print: a can, a box and a cube with blocks of random brightness, made here.
#pragma once

#include <cstdint>
#include <string>

#include "simulated_sequence.h"

namespace prescene::filter_tests {

/// A can about z, 7 x 11 cm, with a print around its side. `seed`: of the print; 0 = one colour.
belief::ObjectModel printed_can(const std::string& name, std::uint64_t seed);
/// A box with a print of its own on each face.
belief::ObjectModel printed_box(const std::string& name, const Vector3d& size, std::uint64_t seed);

}  // namespace prescene::filter_tests
