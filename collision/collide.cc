// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/triangle_queries.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "collide.cc"
#include <hwy/foreach_target.h>
// After foreach_target.h, which includes this file once for each instruction set.
#include <hwy/highway.h>

#include "leaf_pairs-inl.h"
#include "pair_traversal-inl.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::collision::HWY_NAMESPACE {

/// The triangles of pair 4 i + k of two blocks; kNoTriangle for the repeated ones of a block with fewer than four,
/// which come after those that they repeat.
inline TrianglePair original(const TriangleTree& a, std::uint32_t block_a, const TriangleTree& b, std::uint32_t block_b,
                             std::uint32_t pair) {
  return {a.references()[block_a][pair / 4], b.references()[block_b][pair % 4]};
}

/// Calls found(block of a, block of b, pairs that intersect) until it returns true; then returns true.
template <class Found>
HWY_INLINE bool for_intersecting_blocks(const TriangleTree& a, const TriangleTree& b, const Transform& X_AB,
                                        QueryScratch* scratch, QueryCounts* counts, const Found& found) {
  const TriangleBlock* blocks_a = a.blocks().data();
  const TriangleBlock* blocks_b = b.blocks().data();
  std::uint64_t exact_tests = 0;
  std::uint64_t triangle_tests = 0;
  const auto leaf = [&](const LeafPair& leaves) HWY_ATTR {
    TriangleBlock placed_b;
    place_block(X_AB, blocks_b[leaves.block_b], &placed_b);
    const std::uint32_t hits = intersecting(blocks_a[leaves.block_a], placed_b, &exact_tests);
    if (counts != nullptr)
      triangle_tests += triangles_in(a.references()[leaves.block_a]) * triangles_in(b.references()[leaves.block_b]);
    return hits != 0 && found(leaves.block_a, leaves.block_b, hits);
  };
  if (counts == nullptr) return for_overlapping_leaves<false>(a, b, X_AB, roots(a, b), scratch, counts, leaf);
  const bool ended = for_overlapping_leaves<true>(a, b, X_AB, roots(a, b), scratch, counts, leaf);
  counts->triangle_tests += triangle_tests;
  counts->exact_tests += exact_tests;
  return ended;
}

bool collide_lanes(const TriangleTree& a, const TriangleTree& b, const Transform& X_AB, QueryScratch* scratch,
                   QueryCounts* counts) {
  return for_intersecting_blocks(a, b, X_AB, scratch, counts,
                                 [](std::uint32_t, std::uint32_t, std::uint32_t) { return true; });
}

bool first_pair_lanes(const TriangleTree& a, const TriangleTree& b, const Transform& X_AB, QueryScratch* scratch,
                      QueryCounts* counts, TrianglePair* pair) {
  const auto found = [&](std::uint32_t block_a, std::uint32_t block_b, std::uint32_t hits) {
    const auto bit = static_cast<std::uint32_t>(std::countr_zero(hits));
    *pair = original(a, block_a, b, block_b, bit);
    return true;
  };
  return for_intersecting_blocks(a, b, X_AB, scratch, counts, found);
}

bool all_pairs_lanes(const TriangleTree& a, const TriangleTree& b, const Transform& X_AB, std::size_t limit,
                     std::vector<TrianglePair>* pairs, QueryScratch* scratch, QueryCounts* counts) {
  const std::size_t most = pairs->size() + limit;
  const auto found = [&](std::uint32_t block_a, std::uint32_t block_b, std::uint32_t hits) {
    for (; hits != 0; hits &= hits - 1) {
      const TrianglePair pair = original(a, block_a, b, block_b, static_cast<std::uint32_t>(std::countr_zero(hits)));
      if (pair.a == kNoTriangle || pair.b == kNoTriangle) continue;
      if (pairs->size() == most) return true;
      pairs->push_back(pair);
    }
    return false;
  };
  return !for_intersecting_blocks(a, b, X_AB, scratch, counts, found);
}

}  // namespace prescene::collision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace prescene::collision {

HWY_EXPORT(collide_lanes);
HWY_EXPORT(first_pair_lanes);
HWY_EXPORT(all_pairs_lanes);

bool collide(const TriangleTree& a, const TriangleTree& b, const Transform& X_AB, QueryScratch& scratch,
             QueryCounts* counts) {
  return HWY_DYNAMIC_DISPATCH(collide_lanes)(a, b, X_AB, &scratch, counts);
}

std::optional<TrianglePair> first_pair(const TriangleTree& a, const TriangleTree& b, const Transform& X_AB,
                                       QueryScratch& scratch, QueryCounts* counts) {
  TrianglePair pair;
  if (!HWY_DYNAMIC_DISPATCH(first_pair_lanes)(a, b, X_AB, &scratch, counts, &pair)) return std::nullopt;
  return pair;
}

bool all_pairs(const TriangleTree& a, const TriangleTree& b, const Transform& X_AB, std::size_t limit,
               std::vector<TrianglePair>* pairs, QueryScratch& scratch, QueryCounts* counts) {
  return HWY_DYNAMIC_DISPATCH(all_pairs_lanes)(a, b, X_AB, limit, pairs, &scratch, counts);
}

}  // namespace prescene::collision
#endif
