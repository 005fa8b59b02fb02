// SPDX-License-Identifier: Apache-2.0
// Simultaneous descent of two TriangleTrees: the children of a pair of nodes are tested against each other, one against
// sixteen, by the separating axes of two boxes [Gottschalk et al. 1996]. Included once for each instruction set.
#include "prescene/collision/query_scratch.h"
#include "prescene/collision/transform.h"
#include "prescene/collision/triangle_tree.h"

#if defined(PRESCENE_COLLISION_PAIR_TRAVERSAL_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef PRESCENE_COLLISION_PAIR_TRAVERSAL_INL_H_
#undef PRESCENE_COLLISION_PAIR_TRAVERSAL_INL_H_
#else
#define PRESCENE_COLLISION_PAIR_TRAVERSAL_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

HWY_BEFORE_NAMESPACE();
namespace prescene::collision::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using Lanes16 = hn::CappedTag<float, 16>;
using V16 = hn::Vec<Lanes16>;

/// Bits of a mask of at most 16 lanes.
HWY_INLINE std::uint32_t mask_bits(Lanes16 d, hn::Mask<Lanes16> mask) {
  std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(d, mask, bytes);
  return static_cast<std::uint32_t>(bytes[0]) | (static_cast<std::uint32_t>(bytes[1]) << 8U);
}

/// Boxes of the children of one node of a pair.
struct ChildBoxes {
  HWY_ALIGN float centre[3][16];  ///< In the node's own frame.
  HWY_ALIGN float half[3][16];
  HWY_ALIGN float other_centre[3][16];  ///< In the frame of the other node.
  HWY_ALIGN float other_half[3][16];    ///< Of the boxes about them there, with slack.
};

/// Roundings of lengths within the nodes: of their axes, and of sums along them.
inline constexpr float kLocalSlack = 16.0F * std::numeric_limits<float>::epsilon();

/// Where node b's frame is in node a's, and their boxes in each other's frames.
struct PairFrame {
  HWY_ALIGN float R_ab[3][4];  ///< [column][row]
  HWY_ALIGN float R_ba[3][4];
  HWY_ALIGN float p_ab[4];
  HWY_ALIGN float p_ba[4];
  HWY_ALIGN float centre_a_b[4];  ///< Of a's box in b's frame.
  HWY_ALIGN float half_a_b[4];    ///< Of the box about it there, with slack.
  HWY_ALIGN float centre_b_a[4];
  HWY_ALIGN float half_b_a[4];
  float slack;  ///< What rounding may have done to a coordinate, m.
};

/// Of a query on two trees, for all of its pairs of nodes.
struct QueryFrame {
  HWY_ALIGN float R_AB[3][4];  ///< [column][row]
  HWY_ALIGN float p_AB[4];
  float slack;
};

inline QueryFrame make_query_frame(const TriangleTree& a, const TriangleTree& b, const Transform& X_AB) {
  QueryFrame frame{};
  float distance = 0.0F;
  for (int row = 0; row < 3; ++row) {
    for (int col = 0; col < 3; ++col) frame.R_AB[col][row] = X_AB.rotation[static_cast<std::size_t>(3 * row + col)];
    frame.p_AB[row] = X_AB.translation[static_cast<std::size_t>(row)];
    distance += std::abs(frame.p_AB[row]);
  }
  // A coordinate of a vertex of B in A's frame comes from three products and three sums, that of a node's origin from
  // twice as many: some 20 roundings of numbers up to this sum.
  frame.slack = 12.0F * std::numeric_limits<float>::epsilon() * (a.radius() + b.radius() + distance);
  return frame;
}

#if HWY_TARGET == HWY_SCALAR

HWY_INLINE void make_pair_frame(const QueryFrame& query, const TriangleTreeNode& a, const TriangleTreeNode& b,
                                PairFrame* pair) {
  float from_a[3];
  for (int c = 0; c < 3; ++c) {
    from_a[c] = query.p_AB[c] - a.origin[c];
    for (int m = 0; m < 3; ++m) from_a[c] += query.R_AB[m][c] * b.origin[m];
  }
  pair->slack = query.slack + kLocalSlack * (a.diagonal + b.diagonal);
  for (int k = 0; k < 3; ++k) {
    pair->p_ab[k] = a.frame[0][k] * from_a[0] + a.frame[1][k] * from_a[1] + a.frame[2][k] * from_a[2];
    pair->centre_b_a[k] = pair->p_ab[k];
    pair->half_b_a[k] = pair->slack;
    for (int m = 0; m < 3; ++m) {
      float sum = 0.0F;
      for (int c = 0; c < 3; ++c) {
        sum += a.frame[c][k] *
               (query.R_AB[0][c] * b.frame[0][m] + query.R_AB[1][c] * b.frame[1][m] + query.R_AB[2][c] * b.frame[2][m]);
      }
      pair->R_ab[m][k] = sum;
      pair->R_ba[k][m] = sum;
      pair->centre_b_a[k] += sum * b.half_extent[m];
      pair->half_b_a[k] += std::abs(sum) * b.half_extent[m];
    }
  }
  for (int m = 0; m < 3; ++m) {
    pair->p_ba[m] = 0.0F;
    pair->centre_a_b[m] = 0.0F;
    pair->half_a_b[m] = pair->slack;
    for (int k = 0; k < 3; ++k) {
      pair->p_ba[m] -= pair->R_ab[m][k] * pair->p_ab[k];
      pair->centre_a_b[m] += pair->R_ab[m][k] * (a.half_extent[k] - pair->p_ab[k]);
      pair->half_a_b[m] += std::abs(pair->R_ab[m][k]) * a.half_extent[k];
    }
  }
}

#else

HWY_INLINE void make_pair_frame(const QueryFrame& query, const TriangleTreeNode& a, const TriangleTreeNode& b,
                                PairFrame* pair) {
  const hn::CappedTag<float, 4> d;
  using V4 = hn::Vec<hn::CappedTag<float, 4> >;
  const V4 r0 = hn::Load(d, query.R_AB[0]);
  const V4 r1 = hn::Load(d, query.R_AB[1]);
  const V4 r2 = hn::Load(d, query.R_AB[2]);
  const V4 a0 = hn::LoadU(d, a.frame[0]);
  const V4 a1 = hn::LoadU(d, a.frame[1]);
  const V4 a2 = hn::LoadU(d, a.frame[2]);
  const auto in_a = [&](V4 v_A) HWY_ATTR {
    const V4 v = hn::MulAdd(a1, hn::Broadcast<1>(v_A), hn::Mul(a0, hn::Broadcast<0>(v_A)));
    return hn::MulAdd(a2, hn::Broadcast<2>(v_A), v);
  };
  const auto in_A = [&](float x, float y, float z) HWY_ATTR {
    return hn::MulAdd(r2, hn::Set(d, z), hn::MulAdd(r1, hn::Set(d, y), hn::Mul(r0, hn::Set(d, x))));
  };
  const V4 c0 = in_a(in_A(b.frame[0][0], b.frame[1][0], b.frame[2][0]));
  const V4 c1 = in_a(in_A(b.frame[0][1], b.frame[1][1], b.frame[2][1]));
  const V4 c2 = in_a(in_A(b.frame[0][2], b.frame[1][2], b.frame[2][2]));
  const V4 origin_A = hn::Add(in_A(b.origin[0], b.origin[1], b.origin[2]), hn::Load(d, query.p_AB));
  // The fourth lane of a's origin holds something else.
  const V4 p_ab = in_a(hn::IfThenElseZero(hn::FirstN(d, 3), hn::Sub(origin_A, hn::LoadU(d, a.origin))));
  // Transposed.
  const V4 xy = hn::InterleaveLower(d, c0, c1);
  const V4 z = hn::InterleaveLower(d, c2, c2);
  const V4 b0 = hn::ConcatLowerLower(d, z, xy);
  const V4 b1 = hn::ConcatUpperUpper(d, z, xy);
  const V4 b2 = hn::ConcatLowerLower(d, hn::InterleaveUpper(d, c2, c2), hn::InterleaveUpper(d, c0, c1));
  const auto in_b = [&](V4 v_a) HWY_ATTR {
    const V4 v = hn::MulAdd(b1, hn::Broadcast<1>(v_a), hn::Mul(b0, hn::Broadcast<0>(v_a)));
    return hn::MulAdd(b2, hn::Broadcast<2>(v_a), v);
  };
  pair->slack = query.slack + kLocalSlack * (a.diagonal + b.diagonal);
  const V4 slack = hn::Set(d, pair->slack);
  const V4 half_a = hn::LoadU(d, a.half_extent);
  const V4 half_b0 = hn::Set(d, b.half_extent[0]);
  const V4 half_b1 = hn::Set(d, b.half_extent[1]);
  const V4 half_b2 = hn::Set(d, b.half_extent[2]);
  const V4 centre_b = hn::MulAdd(c0, half_b0, hn::MulAdd(c1, half_b1, hn::MulAdd(c2, half_b2, p_ab)));
  const V4 extent_b =
      hn::MulAdd(hn::Abs(c0), half_b0, hn::MulAdd(hn::Abs(c1), half_b1, hn::MulAdd(hn::Abs(c2), half_b2, slack)));
  const V4 extent_a = hn::MulAdd(
      hn::Abs(b0), hn::Broadcast<0>(half_a),
      hn::MulAdd(hn::Abs(b1), hn::Broadcast<1>(half_a), hn::MulAdd(hn::Abs(b2), hn::Broadcast<2>(half_a), slack)));
  hn::Store(c0, d, pair->R_ab[0]);
  hn::Store(c1, d, pair->R_ab[1]);
  hn::Store(c2, d, pair->R_ab[2]);
  hn::Store(b0, d, pair->R_ba[0]);
  hn::Store(b1, d, pair->R_ba[1]);
  hn::Store(b2, d, pair->R_ba[2]);
  hn::Store(p_ab, d, pair->p_ab);
  hn::Store(hn::Neg(in_b(p_ab)), d, pair->p_ba);
  hn::Store(centre_b, d, pair->centre_b_a);
  hn::Store(extent_b, d, pair->half_b_a);
  hn::Store(in_b(hn::Sub(half_a, p_ab)), d, pair->centre_a_b);
  hn::Store(extent_a, d, pair->half_a_b);
}

#endif

/// Decodes the boxes of one coordinate k of a node.
HWY_INLINE void decode(const TriangleTreeNode& node, int k, std::size_t lane, V16* centre, V16* half) {
  const Lanes16 d;
  const hn::RebindToSigned<Lanes16> di;
  const hn::Rebind<std::uint8_t, Lanes16> d8;
  const auto low = hn::PromoteTo(di, hn::LoadU(d8, node.low[k] + lane));
  const auto high = hn::PromoteTo(di, hn::LoadU(d8, node.high[k] + lane));
  const V16 half_step = hn::Set(d, node.frame[k][3]);
  *centre = hn::Mul(hn::ConvertTo(d, hn::Add(low, high)), half_step);
  *half = hn::Mul(hn::ConvertTo(d, hn::Sub(high, low)), half_step);
}

/// |centre - point| <= half + reach, for a box and the extent of another along one axis.
HWY_INLINE hn::Mask<Lanes16> reaches(V16 centre, V16 half, float point, float reach) {
  const Lanes16 d;
  return hn::Le(hn::Abs(hn::Sub(centre, hn::Set(d, point))), hn::Add(half, hn::Set(d, reach)));
}

/// Which boxes of a node's children reach the box about the other node's, in this node's frame.
HWY_INLINE std::uint32_t reaching_children(const TriangleTreeNode& node, const float* other_centre,
                                           const float* other_half) {
  const Lanes16 d;
  std::uint32_t reach = 0;
  for (std::size_t lane = 0; lane < 16; lane += hn::Lanes(d)) {
    hn::Mask<Lanes16> in;
    for (int k = 0; k < 3; ++k) {
      V16 centre;
      V16 half;
      decode(node, k, lane, &centre, &half);
      const auto along = reaches(centre, half, other_centre[k], other_half[k]);
      in = k == 0 ? along : hn::And(in, along);
    }
    reach |= mask_bits(d, in) << lane;
  }
  return reach;
}

/// Puts the boxes of a node's children into its own frame and the other node's, and tells which reach the other node's
/// box, which has its low corner at the origin and its centre at `mid`. R[k] is the row of coordinate k.
HWY_INLINE std::uint32_t place_children(const TriangleTreeNode& node, const float (&R)[3][4], const float* p,
                                        float slack, const float* mid, ChildBoxes* boxes) {
  const Lanes16 d;
  std::uint32_t reach = 0;
  for (std::size_t lane = 0; lane < 16; lane += hn::Lanes(d)) {
    V16 centre[3];
    V16 half[3];
    for (int k = 0; k < 3; ++k) {
      decode(node, k, lane, &centre[k], &half[k]);
      hn::Store(centre[k], d, boxes->centre[k] + lane);
      hn::Store(half[k], d, boxes->half[k] + lane);
    }
    hn::Mask<Lanes16> in;
    for (int k = 0; k < 3; ++k) {
      V16 c = hn::MulAdd(centre[0], hn::Set(d, R[k][0]), hn::Set(d, p[k]));
      c = hn::MulAdd(centre[1], hn::Set(d, R[k][1]), c);
      c = hn::MulAdd(centre[2], hn::Set(d, R[k][2]), c);
      V16 h = hn::MulAdd(half[0], hn::Set(d, std::abs(R[k][0])), hn::Set(d, slack));
      h = hn::MulAdd(half[1], hn::Set(d, std::abs(R[k][1])), h);
      h = hn::MulAdd(half[2], hn::Set(d, std::abs(R[k][2])), h);
      hn::Store(c, d, boxes->other_centre[k] + lane);
      hn::Store(h, d, boxes->other_half[k] + lane);
      const auto along = reaches(c, h, mid[k], mid[k]);
      in = k == 0 ? along : hn::And(in, along);
    }
    reach |= mask_bits(d, in) << lane;
  }
  return reach;
}

/// What the nine axes across edges need, for rows of `p` against lanes of `q`.
struct CrossTerms {
  HWY_ALIGN float row[9][16];   ///< Half extent of each box of p along axis e_i x a_k, index 3 i + k; with slack.
  HWY_ALIGN float lane[9][16];  ///< Half extent of each box of q.
};

/// R[i][k]: coordinate i in q's frame of p's axis k.
HWY_INLINE void make_cross_terms(const float (&R)[3][4], float slack, const ChildBoxes& p, const ChildBoxes& q,
                                 CrossTerms* terms) {
  const Lanes16 d;
  for (std::size_t lane = 0; lane < 16; lane += hn::Lanes(d)) {
    V16 hp[3];
    V16 hq[3];
    for (int k = 0; k < 3; ++k) {
      hp[k] = hn::Load(d, p.half[k] + lane);
      hq[k] = hn::Load(d, q.half[k] + lane);
    }
    for (int i = 0; i < 3; ++i) {
      const int i1 = (i + 1) % 3;
      const int i2 = (i + 2) % 3;
      for (int k = 0; k < 3; ++k) {
        const int k1 = (k + 1) % 3;
        const int k2 = (k + 2) % 3;
        const V16 row = hn::MulAdd(hp[k1], hn::Set(d, std::abs(R[i][k2])),
                                   hn::MulAdd(hp[k2], hn::Set(d, std::abs(R[i][k1])), hn::Set(d, slack)));
        const V16 other =
            hn::MulAdd(hq[i1], hn::Set(d, std::abs(R[i2][k])), hn::Mul(hq[i2], hn::Set(d, std::abs(R[i1][k]))));
        hn::Store(row, d, terms->row[3 * i + k] + lane);
        hn::Store(other, d, terms->lane[3 * i + k] + lane);
      }
    }
  }
}

/// Which boxes of q overlap box `row` of p along the six axes of the faces.
HWY_INLINE std::uint32_t overlap_on_faces(const ChildBoxes& p, std::uint32_t row, const ChildBoxes& q) {
  const Lanes16 d;
  std::uint32_t bits = 0;
  for (std::size_t lane = 0; lane < 16; lane += hn::Lanes(d)) {
    V16 worst = hn::Sub(hn::Abs(hn::Sub(hn::Load(d, q.centre[0] + lane), hn::Set(d, p.other_centre[0][row]))),
                        hn::Add(hn::Load(d, q.half[0] + lane), hn::Set(d, p.other_half[0][row])));
    for (int k = 1; k < 3; ++k) {
      worst =
          hn::Max(worst, hn::Sub(hn::Abs(hn::Sub(hn::Load(d, q.centre[k] + lane), hn::Set(d, p.other_centre[k][row]))),
                                 hn::Add(hn::Load(d, q.half[k] + lane), hn::Set(d, p.other_half[k][row]))));
    }
    for (int k = 0; k < 3; ++k) {
      worst =
          hn::Max(worst, hn::Sub(hn::Abs(hn::Sub(hn::Load(d, q.other_centre[k] + lane), hn::Set(d, p.centre[k][row]))),
                                 hn::Add(hn::Load(d, q.other_half[k] + lane), hn::Set(d, p.half[k][row]))));
    }
    bits |= mask_bits(d, hn::Le(worst, hn::Zero(d))) << lane;
  }
  return bits;
}

/// The same along the nine axes across edges.
HWY_INLINE std::uint32_t overlap_across_edges(const float (&R)[3][4], const CrossTerms& terms, const ChildBoxes& p,
                                              std::uint32_t row, const ChildBoxes& q) {
  const Lanes16 d;
  std::uint32_t bits = 0;
  for (std::size_t lane = 0; lane < 16; lane += hn::Lanes(d)) {
    V16 apart[3];
    for (int k = 0; k < 3; ++k) apart[k] = hn::Sub(hn::Load(d, q.centre[k] + lane), hn::Set(d, p.other_centre[k][row]));
    V16 worst = hn::Set(d, -1.0F);
    for (int i = 0; i < 3; ++i) {
      const int i1 = (i + 1) % 3;
      const int i2 = (i + 2) % 3;
      for (int k = 0; k < 3; ++k) {
        const V16 along = hn::Sub(hn::Mul(apart[i2], hn::Set(d, R[i1][k])), hn::Mul(apart[i1], hn::Set(d, R[i2][k])));
        const V16 reach = hn::Add(hn::Load(d, terms.lane[3 * i + k] + lane), hn::Set(d, terms.row[3 * i + k][row]));
        worst = hn::Max(worst, hn::Sub(hn::Abs(along), reach));
      }
    }
    bits |= mask_bits(d, hn::Le(worst, hn::Zero(d))) << lane;
  }
  return bits;
}

HWY_INLINE std::uint32_t rank_below(std::uint32_t mask, std::uint32_t bit) {
  return static_cast<std::uint32_t>(std::popcount(mask & ((1U << bit) - 1U)));
}

/// Child i of a node, which is a node itself.
HWY_INLINE std::uint32_t child_node(const TriangleTreeNode& node, std::uint32_t i) {
  return node.first_child + rank_below(static_cast<std::uint32_t>(node.child_mask & ~node.leaf_mask), i);
}
/// Block of child i of a node, which is a leaf.
HWY_INLINE std::uint32_t child_block(const TriangleTreeNode& node, std::uint32_t i) {
  return node.first_leaf + rank_below(node.leaf_mask, i);
}

/// The children of two nodes against each other: what overlaps is pushed, or is a pair of leaves. Returns whether a
/// leaf ended it.
template <bool kCount, class Leaf>
HWY_INLINE bool descend(const NodePair& at, const PairFrame& pair, const TriangleTreeNode* nodes_a,
                        const TriangleTreeNode* nodes_b, std::vector<NodePair>* stack, QueryCounts* counts,
                        const Leaf& leaf) {
  const TriangleTreeNode& a = nodes_a[at.a];
  const TriangleTreeNode& b = nodes_b[at.b];
  ChildBoxes boxes_a;
  ChildBoxes boxes_b;
  const std::uint32_t in_a =
      at.a_children & place_children(a, pair.R_ab, pair.p_ba, pair.slack, b.half_extent, &boxes_a);
  if (in_a == 0) return false;
  const std::uint32_t in_b =
      at.b_children & place_children(b, pair.R_ba, pair.p_ab, pair.slack, a.half_extent, &boxes_b);
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
  const float(&R)[3][4] = rows_are_a ? pair.R_ab : pair.R_ba;
  const auto push = [&](std::uint32_t node_of_p, std::uint32_t node_of_q, std::uint32_t of_p, std::uint32_t of_q) {
    if (rows_are_a) {
      stack->push_back({node_of_p, node_of_q, static_cast<std::uint16_t>(of_p), static_cast<std::uint16_t>(of_q)});
    } else {
      stack->push_back({node_of_q, node_of_p, static_cast<std::uint16_t>(of_q), static_cast<std::uint16_t>(of_p)});
    }
  };
  CrossTerms terms;
  bool have_terms = false;
  std::uint16_t leaves_of_p[16] = {};  // Leaves of p that overlap child i of q, which is a node.
  std::uint32_t q_with_leaves = 0;
  for (std::uint32_t rows = rows_are_a ? in_a : in_b; rows != 0; rows &= rows - 1) {
    const auto row = static_cast<std::uint32_t>(std::countr_zero(rows));
    std::uint32_t hits = overlap_on_faces(p, row, q) & in_q;
    if constexpr (kCount) counts->volume_tests += static_cast<std::uint64_t>(std::popcount(in_q));
    if (hits == 0) continue;
    if (!have_terms) {
      make_cross_terms(R, pair.slack, p, q, &terms);
      have_terms = true;
    }
    hits &= overlap_across_edges(R, terms, p, row, q);
    if (hits == 0) continue;
    const std::uint32_t leaf_hits = hits & node_q.leaf_mask;
    std::uint32_t node_hits = hits & ~leaf_hits;
    if ((node_p.leaf_mask >> row & 1U) != 0) {
      for (std::uint32_t rest = leaf_hits; rest != 0; rest &= rest - 1) {
        const std::uint32_t block_p = child_block(node_p, row);
        const std::uint32_t block_q = child_block(node_q, static_cast<std::uint32_t>(std::countr_zero(rest)));
        if (rows_are_a ? leaf(block_p, block_q) : leaf(block_q, block_p)) return true;
      }
      q_with_leaves |= node_hits;
      for (; node_hits != 0; node_hits &= node_hits - 1)
        leaves_of_p[std::countr_zero(node_hits)] |= static_cast<std::uint16_t>(1U << row);
      continue;
    }
    const std::uint32_t child_p = child_node(node_p, row);
    const std::uint32_t all_p = nodes_p[child_p].child_mask;
    if (leaf_hits != 0) push(child_p, rows_are_a ? at.b : at.a, all_p, leaf_hits);
    for (; node_hits != 0; node_hits &= node_hits - 1) {
      const std::uint32_t child_q = child_node(node_q, static_cast<std::uint32_t>(std::countr_zero(node_hits)));
      push(child_p, child_q, all_p, nodes_q[child_q].child_mask);
    }
  }
  for (; q_with_leaves != 0; q_with_leaves &= q_with_leaves - 1) {
    const auto i = static_cast<std::uint32_t>(std::countr_zero(q_with_leaves));
    const std::uint32_t child_q = child_node(node_q, i);
    push(rows_are_a ? at.a : at.b, child_q, leaves_of_p[i], nodes_q[child_q].child_mask);
  }
  return false;
}

/// Calls leaf(block of a, block of b) for pairs of leaves whose boxes overlap, until it returns true (then so does
/// this).
template <bool kCount, class Leaf>
HWY_INLINE bool for_overlapping_leaves(const TriangleTree& tree_a, const TriangleTree& tree_b, const Transform& X_AB,
                                       QueryScratch* scratch, QueryCounts* counts, const Leaf& leaf) {
  // So many pairs are begun before the first is looked at, so that the processor need not guess what comes of one
  // before it can go on with the next.
  constexpr std::size_t kAtOnce = 4;
  const QueryFrame query = make_query_frame(tree_a, tree_b, X_AB);
  const TriangleTreeNode* nodes_a = tree_a.nodes().data();
  const TriangleTreeNode* nodes_b = tree_b.nodes().data();
  std::vector<NodePair>& stack = scratch->node_pairs();
  stack.clear();
  stack.push_back({0, 0, nodes_a[0].child_mask, nodes_b[0].child_mask});
  NodePair begun[kAtOnce];
  PairFrame frames[kAtOnce];
  while (!stack.empty()) {
    const std::size_t count = std::min(kAtOnce, stack.size());
    for (std::size_t i = 0; i < count; ++i) {
      begun[i] = stack[stack.size() - 1 - i];
      const TriangleTreeNode& a = nodes_a[begun[i].a];
      const TriangleTreeNode& b = nodes_b[begun[i].b];
      make_pair_frame(query, a, b, &frames[i]);
      begun[i].a_children &= static_cast<std::uint16_t>(reaching_children(a, frames[i].centre_b_a, frames[i].half_b_a));
      begun[i].b_children &= static_cast<std::uint16_t>(reaching_children(b, frames[i].centre_a_b, frames[i].half_a_b));
    }
    stack.resize(stack.size() - count);
    for (std::size_t i = 0; i < count; ++i) {
      if constexpr (kCount) {
        ++counts->node_pairs;
        counts->volume_tests += 32;
      }
      if (begun[i].a_children == 0 || begun[i].b_children == 0) continue;
      if (descend<kCount>(begun[i], frames[i], nodes_a, nodes_b, &stack, counts, leaf)) return true;
    }
  }
  return false;
}

}  // namespace prescene::collision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
