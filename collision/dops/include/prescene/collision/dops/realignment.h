// SPDX-License-Identifier: Apache-2.0
// How planes of k-DOPs are stored, and how those of a turned and shifted body are bounded along the directions of
// another one: "dynamically aligned DOP-trees" [Zachmann 1998].
//
// Body B's DOP lies, in A's frame, in the polytope of B's turned planes. How far that reaches against A's direction d
// is bounded by the corner of the three planes between whose normals the turned d lies: a sum of three stored planes
// with weights that depend on the rotation only. So two bodies' volumes are disjoint if for some direction p
// A's plane p is less than constant[p] minus the sum of weights[p][n] * B's plane planes[p][n] over n = 0, 1, 2.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "prescene/collision/dops/directions.h"
#include "prescene/collision/hierarchy.h"
#include "prescene/collision/mesh.h"
#include "prescene/collision/transform.h"
#include "prescene/core/parallel.h"

namespace prescene::collision {

/// Planes are stored relative to a centre and divided by a length, so that they are at most 1 and half precision, which
/// is finest about zero, serves any mesh.
struct DopSpace {
  std::array<float, 3> centre = {0, 0, 0};  ///< Of the mesh's box, in its frame, m.
  float inverse_length = 1.0F;              ///< A power of two, 1/m; the length is at least the mesh's radius.
  std::array<float, 3> reach = {0, 0, 0};   ///< Largest coordinates in the mesh's frame, m.

  static DopSpace of(const Mesh& mesh);

  friend bool operator==(const DopSpace&, const DopSpace&) = default;
};

/// The k planes of each node of `shape`, node after node: tight about the triangles below it, in units of the space's
/// length, rounded outward.
std::vector<float> fit_planes(const DopDirections& directions, const DopSpace& space, const Mesh& mesh,
                              const Hierarchy& shape, core::ThreadPool& pool);

/// Rounded up, also to half precision. Finite input.
float round_up(double value);
std::uint16_t round_up_to_half(double value);
/// Of a half that is not negative: single precision with the half's exponent, brought to its bias by a product, which
/// treats subnormal halves alike.
inline float from_positive_half(std::uint16_t value) {
  return std::bit_cast<float>(static_cast<std::uint32_t>(value) << 13U) * 0x1p112F;
}
inline float from_half(std::uint16_t value) {
  const float magnitude = from_positive_half(value & 0x7FFFU);
  return (value & 0x8000U) != 0 ? -magnitude : magnitude;
}

struct Realignment {
  struct Direction {
    std::array<float, 3> weights;
    std::array<float, 3> against;  ///< Sum of the three planes' normals with these weights.
    float constant;
    std::array<std::uint8_t, 3> planes;
  };
  std::array<Direction, 2 * kMostDopAxes> directions;  ///< The first k are used.

  /// `constant` makes room for all rounding: of B's vertices when they are put into A's frame (transform.h), of the
  /// weights, and of the sum, with or without fused operations, also when it is moved by SIMDop's shifts.
  Realignment(const DopDirections& dop_directions, const DopSpace& space_a, const DopSpace& space_b,
              const Transform& X_AB);
};

/// What A's plane in this direction must reach at least if the volumes are not disjoint.
inline float realigned(const Realignment::Direction& direction, const float* planes_b, std::size_t stride = 1) {
  return ((direction.constant - direction.weights[0] * planes_b[direction.planes[0] * stride]) -
          direction.weights[1] * planes_b[direction.planes[1] * stride]) -
         direction.weights[2] * planes_b[direction.planes[2] * stride];
}

}  // namespace prescene::collision
