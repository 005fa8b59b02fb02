// SPDX-License-Identifier: Apache-2.0
// The triangles of two leaves against each other. Included once for each instruction set.
#if defined(PRESCENE_COLLISION_LEAF_PAIRS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef PRESCENE_COLLISION_LEAF_PAIRS_INL_H_
#undef PRESCENE_COLLISION_LEAF_PAIRS_INL_H_
#else
#define PRESCENE_COLLISION_LEAF_PAIRS_INL_H_
#endif

#include <hwy/highway.h>

#include "prescene/collision/exact_triangles.h"
#include "prescene/collision/triangle_pairs-inl.h"
#include "prescene/collision/triangle_tree.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::collision::HWY_NAMESPACE {

/// The four triangles of a block of B, in A's frame.
HWY_INLINE void place_block(const Transform& X_AB, const TriangleBlock& block_B, TriangleBlock* block_A) {
  const hn::CappedTag<float, 4> d;
  for (std::size_t lane = 0; lane < 4; lane += hn::Lanes(d)) {
    const auto corners_A = placed(d, X_AB, load_corners(d, &block_B.corners[0][0][0], 4, lane));
    for (std::size_t corner = 0; corner < 3; ++corner) {
      hn::Store(corners_A[corner].x, d, block_A->corners[corner][0] + lane);
      hn::Store(corners_A[corner].y, d, block_A->corners[corner][1] + lane);
      hn::Store(corners_A[corner].z, d, block_A->corners[corner][2] + lane);
    }
  }
}

inline Triangle triangle_of(const TriangleBlock& block, std::uint32_t i) {
  Triangle triangle;
  for (std::size_t corner = 0; corner < 3; ++corner) {
    triangle[corner] = {block.corners[corner][0][i], block.corners[corner][1][i], block.corners[corner][2][i]};
  }
  return triangle;
}

/// Which of the pairs 4 i + k of triangle i of a and triangle k of b intersect, both blocks in one frame.
HWY_INLINE std::uint32_t intersecting(const TriangleBlock& a, const TriangleBlock& b, std::uint64_t* exact_tests) {
  const PairVerdict verdict = test_4_against_4(&a.corners[0][0][0], &b.corners[0][0][0]);
  std::uint32_t hits = verdict.hit;
  for (std::uint32_t rest = verdict.unsure; rest != 0; rest &= rest - 1) {
    const auto pair = static_cast<std::uint32_t>(std::countr_zero(rest));
    if (triangles_intersect(triangle_of(a, pair / 4), triangle_of(b, pair % 4))) hits |= 1U << pair;
    ++*exact_tests;
  }
  return hits;
}

}  // namespace prescene::collision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
