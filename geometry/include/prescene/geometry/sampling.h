// SPDX-License-Identifier: Apache-2.0
// Random rotations and directions, drawn from a stream or made from points of a net.
#pragma once

#include <array>

#include "prescene/core/random.h"
#include "prescene/geometry/pose.h"

namespace prescene::geometry {

/// Uniform over rotations from three uniform numbers in (0, 1) [Shoemake 1992].
Quaterniond uniform_rotation(const std::array<double, 3>& u);
Quaterniond uniform_rotation(core::RandomStream& stream);
/// Uniform unit vector from two uniform numbers in (0, 1) (cylinder projection, Archimedes).
Vector3d uniform_direction(const std::array<double, 2>& u);
Vector3d uniform_direction(core::RandomStream& stream);
/// Three independent standard normals.
Vector3d normal_vector(core::RandomStream& stream);

}  // namespace prescene::geometry
