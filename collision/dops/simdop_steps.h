// SPDX-License-Identifier: Apache-2.0
// A Realignment as SIMDop's kernels go through it: in the order of the stored planes, upper and lower one of each axis
// after each other.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "prescene/collision/dops/realignment.h"

namespace prescene::collision {

struct SimdopSteps {
  static constexpr std::size_t kMost = 48;  // 46, and up to a whole vector.

  std::size_t count = 0;
  alignas(64) std::array<float, kMost> constant = {};
  alignas(64) std::array<std::array<float, kMost>, 3> weights = {};
  alignas(64) std::array<std::array<std::int32_t, kMost>, 3> planes = {};
  /// By how much the constant falls when the point that A's planes are relative to moves by one along x, y, z.
  alignas(64) std::array<std::array<float, kMost>, 3> shift_a = {};
  alignas(64) std::array<std::array<float, kMost>, 3> shift_b = {};

  SimdopSteps(const DopDirections& directions, const Realignment& realignment)
      : count(static_cast<std::size_t>(directions.k())) {
    const std::size_t axes = count / 2;
    for (std::size_t s = 0; s < count; ++s) {
      const std::size_t p = s % 2 == 0 ? s / 2 : axes + s / 2;
      const DopAxis d = directions.direction(p);
      const Realignment::Direction& direction = realignment.directions[p];
      for (std::size_t c = 0; c < 3; ++c) {
        shift_a[c][s] = static_cast<float>(d[c]);
        shift_b[c][s] = direction.against[c];
      }
      constant[s] = direction.constant;
      for (std::size_t n = 0; n < 3; ++n) {
        const std::size_t plane = direction.planes[n];
        weights[n][s] = direction.weights[n];
        planes[n][s] = static_cast<std::int32_t>(plane < axes ? 2 * plane : 2 * (plane - axes) + 1);
      }
    }
  }
};

}  // namespace prescene::collision
