// SPDX-License-Identifier: Apache-2.0
// Simultaneous descent of two TriangleTrees: which children of a pair of nodes are to be looked at next. Included once
// for each instruction set.
#if defined(PRESCENE_COLLISION_PAIR_TRAVERSAL_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef PRESCENE_COLLISION_PAIR_TRAVERSAL_INL_H_
#undef PRESCENE_COLLISION_PAIR_TRAVERSAL_INL_H_
#else
#define PRESCENE_COLLISION_PAIR_TRAVERSAL_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <bit>

#include "child_boxes-inl.h"
#include "pair_frames-inl.h"
#include "prescene/collision/query_scratch.h"
#include "prescene/collision/transform.h"
#include "prescene/collision/triangle_tree.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::collision::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

HWY_INLINE std::uint32_t rank_below(std::uint32_t mask, std::uint32_t bit) {
  return static_cast<std::uint32_t>(std::popcount(mask & ((1U << bit) - 1U)));
}

/// Child i of a node, which is a node itself.
HWY_INLINE std::uint32_t child_node(const TriangleTreeNode& node, std::uint32_t i) {
  return node.first_child() + rank_below(node.child_mask() & ~node.leaf_mask(), i);
}
/// Block of child i of a node, which is a leaf.
HWY_INLINE std::uint32_t child_block(const TriangleTreeNode& node, std::uint32_t i) {
  return node.first_leaf() + rank_below(node.leaf_mask(), i);
}

/// Two leaves whose boxes overlap: their blocks, and which children they are of the nodes of their pair.
struct LeafPair {
  std::uint32_t block_a;
  std::uint32_t block_b;
  std::uint32_t child_a;
  std::uint32_t child_b;
};

/// The children of two nodes against each other: push(NodePair) for what overlaps and has children, leaf(LeafPair) for
/// leaves. Returns whether `leaf` did, which ends it. `at` is the place of the pair in `frames`.
template <bool kCount, class Push, class Leaf>
HWY_INLINE bool descend(const NodePair& pair, const PairFrames& frames, std::size_t at, const TriangleTreeNode* nodes_a,
                        const TriangleTreeNode* nodes_b, QueryCounts* counts, const Push& push, const Leaf& leaf) {
  const TriangleTreeNode& a = nodes_a[pair.a];
  const TriangleTreeNode& b = nodes_b[pair.b];
  const float slack = frames.slack[at];
  const Placement X_ab = {{frames.R_ba[0] + at, frames.R_ba[1] + at, frames.R_ba[2] + at}, frames.p_ab + at, slack};
  const Placement X_ba = {{frames.R_ab[0] + at, frames.R_ab[1] + at, frames.R_ab[2] + at}, frames.p_ba + at, slack};
  ChildBoxes boxes_a;
  ChildBoxes boxes_b;
  const std::uint32_t in_a = place_children(a, pair.a_children, X_ba, b.half_extent, &boxes_a);
  if (in_a == 0) return false;
  const std::uint32_t in_b = place_children(b, pair.b_children, X_ab, a.half_extent, &boxes_b);
  if (in_b == 0) return false;

  // Rows are the side with fewer children left.
  const bool rows_are_a = std::popcount(in_a) <= std::popcount(in_b);
  const ChildBoxes& p = rows_are_a ? boxes_a : boxes_b;
  const ChildBoxes& q = rows_are_a ? boxes_b : boxes_a;
  const TriangleTreeNode& node_p = rows_are_a ? a : b;
  const TriangleTreeNode& node_q = rows_are_a ? b : a;
  const TriangleTreeNode* nodes_p = rows_are_a ? nodes_a : nodes_b;
  const TriangleTreeNode* nodes_q = rows_are_a ? nodes_b : nodes_a;
  const std::uint32_t in_q = rows_are_a ? in_b : in_a;
  const float* const(&R)[3] = rows_are_a ? X_ba.rows : X_ab.rows;
  const auto push_rows = [&](std::uint32_t below_p, std::uint32_t below_q, std::uint32_t of_p, std::uint32_t of_q) {
    const auto some_p = static_cast<std::uint16_t>(of_p);
    const auto some_q = static_cast<std::uint16_t>(of_q);
    push(rows_are_a ? NodePair{below_p, below_q, some_p, some_q} : NodePair{below_q, below_p, some_q, some_p});
  };
  // Each step is done for all rows before the next, so that the processor need not guess what comes of one.
  std::uint32_t rows[16];
  std::uint32_t hits_of[16];
  std::uint32_t count = 0;
  for (std::uint32_t rest = rows_are_a ? in_a : in_b; rest != 0; rest &= rest - 1) {
    rows[count] = static_cast<std::uint32_t>(std::countr_zero(rest));
    hits_of[count] = overlap_on_faces(p, rows[count], q) & in_q;
    count += hits_of[count] != 0 ? 1 : 0;
    if constexpr (kCount) counts->volume_tests += static_cast<std::uint64_t>(std::popcount(in_q));
  }
  if (count == 0) return false;
  CrossTerms terms;
  make_cross_terms(R, slack, p, q, &terms);
  std::uint32_t left = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t hits = hits_of[i] & overlap_across_edges(R, terms, p, rows[i], q);
    rows[left] = rows[i];
    hits_of[left] = hits;
    left += hits != 0 ? 1 : 0;
  }
  std::uint16_t leaves_of_p[16] = {};  // Leaves of p that overlap child i of q, which is a node.
  std::uint32_t q_with_leaves = 0;
  for (std::uint32_t i = 0; i < left; ++i) {
    std::uint32_t hits = hits_of[i];
    const std::uint32_t child_of_p = rows[i];
    const bool p_is_leaf = (node_p.leaf_mask() >> child_of_p & 1U) != 0;
    const std::uint32_t below_p = p_is_leaf ? child_block(node_p, child_of_p) : child_node(node_p, child_of_p);
    const std::uint32_t all_p = p_is_leaf ? 0 : nodes_p[below_p].child_mask();
    std::uint32_t leaves_of_q = 0;
    for (; hits != 0; hits &= hits - 1) {
      const auto child_of_q = static_cast<std::uint32_t>(std::countr_zero(hits));
      const bool q_is_leaf = (node_q.leaf_mask() >> child_of_q & 1U) != 0;
      if (p_is_leaf && q_is_leaf) {
        const std::uint32_t block_q = child_block(node_q, child_of_q);
        if (leaf(rows_are_a ? LeafPair{below_p, block_q, child_of_p, child_of_q}
                            : LeafPair{block_q, below_p, child_of_q, child_of_p}))
          return true;
      } else if (p_is_leaf) {
        q_with_leaves |= 1U << child_of_q;
        leaves_of_p[child_of_q] |= static_cast<std::uint16_t>(1U << child_of_p);
      } else if (q_is_leaf) {
        leaves_of_q |= 1U << child_of_q;
      } else {
        const std::uint32_t below_q = child_node(node_q, child_of_q);
        push_rows(below_p, below_q, all_p, nodes_q[below_q].child_mask());
      }
    }
    if (leaves_of_q != 0) push_rows(below_p, rows_are_a ? pair.b : pair.a, all_p, leaves_of_q);
  }
  for (; q_with_leaves != 0; q_with_leaves &= q_with_leaves - 1) {
    const auto child_of_q = static_cast<std::uint32_t>(std::countr_zero(q_with_leaves));
    const std::uint32_t below_q = child_node(node_q, child_of_q);
    push_rows(rows_are_a ? pair.a : pair.b, below_q, leaves_of_p[child_of_q], nodes_q[below_q].child_mask());
  }
  return false;
}

/// Calls leaf(LeafPair) for pairs of leaves below `first` whose boxes overlap, until it returns true (then so does
/// this).
template <bool kCount, class Leaf>
HWY_INLINE bool for_overlapping_leaves(const TriangleTree& tree_a, const TriangleTree& tree_b, const Transform& X_AB,
                                       const NodePair& first, QueryScratch* scratch, QueryCounts* counts,
                                       const Leaf& leaf) {
  const QueryFrame query = make_query_frame(tree_a, tree_b, X_AB);
  const TriangleTreeNode* nodes_a = tree_a.nodes().data();
  const TriangleTreeNode* nodes_b = tree_b.nodes().data();
  std::vector<NodePair>& stack = scratch->node_pairs();
  stack.clear();
  stack.push_back(first);
  const auto push = [&stack](const NodePair& pair) { stack.push_back(pair); };
  PairFrames frames;
  while (!stack.empty()) {
    const std::size_t count = std::min(kAtOnce, stack.size());
    NodePair begun[kAtOnce];
    Nodes a;
    Nodes b;
    for (std::size_t i = 0; i < kAtOnce; ++i) {
      begun[i] = stack[stack.size() - 1 - std::min(i, count - 1)];
      a[i] = &nodes_a[begun[i].a];
      b[i] = &nodes_b[begun[i].b];
    }
    stack.resize(stack.size() - count);
    if (count < kAtOnce - 1) {
      make_pair_frames(OneBlock(), query, a, b, count, &frames);
    } else {
      make_pair_frames(Floats16(), query, a, b, kAtOnce, &frames);
    }
    for (std::size_t i = 0; i < count; ++i) {
      begun[i].a_children &=
          static_cast<std::uint16_t>(children_that_meet(*a[i], frames.low_of_b + 4 * i, frames.high_of_b + 4 * i));
      begun[i].b_children &=
          static_cast<std::uint16_t>(children_that_meet(*b[i], frames.low_of_a + 4 * i, frames.high_of_a + 4 * i));
    }
    for (std::size_t i = 0; i < count; ++i) {
      if constexpr (kCount) {
        ++counts->node_pairs;
        counts->volume_tests += 32;
      }
      if (begun[i].a_children == 0 || begun[i].b_children == 0) continue;
      if (descend<kCount>(begun[i], frames, 4 * i, nodes_a, nodes_b, counts, push, leaf)) return true;
    }
  }
  return false;
}

/// All children of the two roots.
inline NodePair roots(const TriangleTree& a, const TriangleTree& b) {
  return {0, 0, static_cast<std::uint16_t>(a.nodes()[0].child_mask()),
          static_cast<std::uint16_t>(b.nodes()[0].child_mask())};
}

}  // namespace prescene::collision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
