// SPDX-License-Identifier: Apache-2.0
// Batches of nasty triangles in the layouts of the kernels.
#pragma once

#include <array>
#include <cstdint>

#include "nasty_triangles.h"
#include "prescene/collision/triangle_pairs.h"
#include "tests/support/target_test.h"

namespace prescene::collision {

inline TriangleCoordinates coordinates(const Triangle& t) {
  return {t[0].x(), t[0].y(), t[0].z(), t[1].x(), t[1].y(), t[1].z(), t[2].x(), t[2].y(), t[2].z()};
}

inline bool bit(std::uint32_t bits, std::size_t i) { return (bits >> i & 1U) != 0; }

struct LaneBatch {
  std::array<NastyPair, 16> pairs;
  alignas(64) std::array<float, 144> a;
  alignas(64) std::array<float, 144> b;
  alignas(64) std::array<float, 36> four_a;  ///< The first four of a.
  alignas(64) std::array<float, 36> four_b;
};

inline LaneBatch nasty_batch(Nastiness nastiness, core::RandomStream& random) {
  LaneBatch batch{};
  for (std::size_t i = 0; i < 16; ++i) {
    batch.pairs[i] = nasty_pair(nastiness, random);
    const TriangleCoordinates a = coordinates(batch.pairs[i].a);
    const TriangleCoordinates b = coordinates(batch.pairs[i].b);
    for (std::size_t r = 0; r < 9; ++r) {
      batch.a[16 * r + i] = a[r];
      batch.b[16 * r + i] = b[r];
      if (i < 4) batch.four_a[4 * r + i] = a[r];
      if (i < 4) batch.four_b[4 * r + i] = b[r];
    }
  }
  return batch;
}

}  // namespace prescene::collision
