// SPDX-License-Identifier: Apache-2.0
// What the kernels of triangle_pairs-inl.h answer, and their scalar twin.
#pragma once

#include <array>
#include <cstdint>

namespace prescene::collision {

/// Bit i belongs to pair i. No bit: the triangles are certainly disjoint. No pair has both bits.
struct PairVerdict {
  std::uint32_t hit = 0;     ///< Certainly intersecting.
  std::uint32_t unsure = 0;  ///< Too close for single precision: ask triangles_intersect of exact_triangles.h.

  friend bool operator==(const PairVerdict&, const PairVerdict&) = default;
};

/// x0 y0 z0 x1 y1 z1 x2 y2 z2: the order of a triangle's nine coordinates in all kernels.
using TriangleCoordinates = std::array<float, 9>;

/// The kernel's test of one pair in plain C++ (bit 0): its oracle. Where the machine fuses multiplications and
/// additions, the kernel is sure of a few pairs more or less; where both are sure they agree.
PairVerdict test_triangle_pair(const TriangleCoordinates& a, const TriangleCoordinates& b);

/// Of the kernels of triangle_distance-inl.h, times the largest side of the box about both triangles.
inline constexpr float kDistanceError = 16.0F / 16777216.0F;

/// The error bounds of intersection tests, derived in triangle_pairs-inl.h.
inline constexpr float kDeterminantError = 49.0F / 16777216.0F;  // 49 u, u = 2^-24
inline constexpr float kUnderflowError = 0x1p-122F;

}  // namespace prescene::collision
