// SPDX-License-Identifier: Apache-2.0
// Degrees, which people read and write; everything else is in radians.
#pragma once

#include <numbers>

namespace prescene::geometry {

/// Radians in a degree.
inline constexpr double kDegree = std::numbers::pi / 180.0;
/// Degrees in a radian.
inline constexpr double kDegreesPerRadian = 180.0 / std::numbers::pi;

}  // namespace prescene::geometry
