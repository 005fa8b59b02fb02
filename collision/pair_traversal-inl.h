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
#include <cstring>
#include <limits>

HWY_BEFORE_NAMESPACE();
namespace prescene::collision::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Sixteen bytes at once to look at all children of a node, eight floats at once for those that are left.
using Bytes16 = hn::CappedTag<std::uint8_t, 16>;
using Floats16 = hn::CappedTag<float, 16>;
using OneBlock = hn::CappedTag<float, 4>;
using V16 = hn::Vec<Floats16>;

/// Bits of a mask of at most 16 lanes.
template <class D>
HWY_INLINE std::uint32_t mask_bits(D d, hn::Mask<D> mask) {
  std::uint8_t bytes[8];
  hn::StoreMaskBits(d, mask, bytes);
  if constexpr (hn::MaxLanes(d) <= 8) {
    return bytes[0];
  } else {
    std::uint16_t bits;
    std::memcpy(&bits, bytes, sizeof bits);
    return bits;
  }
}

template <class D>
HWY_INLINE hn::Mask<D> mask_of(D d, std::uint64_t bits) {
  std::uint8_t bytes[8];
  std::memcpy(bytes, &bits, sizeof bits);
  return hn::LoadMaskBits(d, bytes);
}

/// Of a query on two trees, for all of its pairs of nodes.
struct QueryFrame {
  HWY_ALIGN float R_AB[3][4];  ///< [column][row]
  HWY_ALIGN float p_AB[4];
  float slack;  ///< What rounding may have done to a coordinate, m.
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

/// Roundings of lengths within the nodes: of their axes, and of sums along them.
inline constexpr float kLocalSlack = 18.0F * std::numeric_limits<float>::epsilon();

/// So many pairs of nodes share the instructions that put them into each other's frames.
inline constexpr std::size_t kAtOnce = 4;

/// Where node b's frame is in node a's, and about where their boxes are in each other's steps; four floats a pair.
struct PairFrames {
  HWY_ALIGN float R_ab[3][4 * kAtOnce];  ///< [column][row]
  HWY_ALIGN float R_ba[3][4 * kAtOnce];
  HWY_ALIGN float p_ab[4 * kAtOnce];
  HWY_ALIGN float p_ba[4 * kAtOnce];
  HWY_ALIGN float slack[4 * kAtOnce];  ///< Four times the same, m.
  // Boxes, with slack, rounded outwards and clamped to what bytes can say.
  HWY_ALIGN std::uint8_t low_of_b[4 * kAtOnce];  ///< In a's steps.
  HWY_ALIGN std::uint8_t high_of_b[4 * kAtOnce];
  HWY_ALIGN std::uint8_t low_of_a[4 * kAtOnce];
  HWY_ALIGN std::uint8_t high_of_a[4 * kAtOnce];
};

using Nodes = const TriangleTreeNode* [kAtOnce];

#if HWY_TARGET == HWY_SCALAR

HWY_INLINE void set_in_steps(const TriangleTreeNode& node, std::size_t k, float centre, float half, std::uint8_t* low,
                             std::uint8_t* high) {
  const float scale = node.steps_per_metre[k];
  *low = static_cast<std::uint8_t>(std::clamp((centre - half) * scale + 1.0F, 0.0F, 255.0F));
  *high = static_cast<std::uint8_t>(std::clamp((centre + half) * scale + 2.0F, 0.0F, 255.0F));
}

HWY_INLINE void make_pair_frame(const QueryFrame& query, const TriangleTreeNode& a, const TriangleTreeNode& b,
                                std::size_t at, PairFrames* frames) {
  float from_a[3];
  for (int c = 0; c < 3; ++c) {
    from_a[c] = query.p_AB[c] - a.origin[c];
    for (int m = 0; m < 3; ++m) from_a[c] += query.R_AB[m][c] * b.origin[m];
  }
  const float slack = query.slack + kLocalSlack * (a.diagonal + b.diagonal);
  for (std::size_t k = 0; k < 3; ++k) {
    const float p = a.axes_x[k] * from_a[0] + a.axes_y[k] * from_a[1] + a.axes_z[k] * from_a[2];
    float centre = p;
    float half = slack;
    for (std::size_t m = 0; m < 3; ++m) {
      float axis_A[3];
      for (std::size_t c = 0; c < 3; ++c) {
        axis_A[c] = query.R_AB[0][c] * b.axes_x[m] + query.R_AB[1][c] * b.axes_y[m] + query.R_AB[2][c] * b.axes_z[m];
      }
      const float cosine = a.axes_x[k] * axis_A[0] + a.axes_y[k] * axis_A[1] + a.axes_z[k] * axis_A[2];
      frames->R_ab[m][at + k] = cosine;
      frames->R_ba[k][at + m] = cosine;
      centre += cosine * b.half_extent[m];
      half += std::abs(cosine) * b.half_extent[m];
    }
    frames->p_ab[at + k] = p;
    frames->slack[at + k] = slack;
    set_in_steps(a, k, centre, half, &frames->low_of_b[at + k], &frames->high_of_b[at + k]);
  }
  for (std::size_t m = 0; m < 3; ++m) {
    float p = 0.0F;
    float centre = 0.0F;
    float half = slack;
    for (std::size_t k = 0; k < 3; ++k) {
      const float cosine = frames->R_ab[m][at + k];
      p -= cosine * frames->p_ab[at + k];
      centre += cosine * (a.half_extent[k] - frames->p_ab[at + k]);
      half += std::abs(cosine) * a.half_extent[k];
    }
    frames->p_ba[at + m] = p;
    set_in_steps(b, m, centre, half, &frames->low_of_a[at + m], &frames->high_of_a[at + m]);
  }
}

template <class D>
HWY_INLINE void make_pair_frames(D, const QueryFrame& query, const Nodes& a, const Nodes& b, std::size_t count,
                                 PairFrames* frames) {
  for (std::size_t i = 0; i < count; ++i) make_pair_frame(query, *a[i], *b[i], 4 * i, frames);
}

#else

/// Four floats of each node, from the first on for which a vector has room.
template <class D, class Field>
HWY_INLINE hn::Vec<D> load_of_each(D d, const Nodes& nodes, std::size_t first, const Field& field) {
  const OneBlock d4;
  if constexpr (hn::MaxLanes(d) == 16) {
    const hn::CappedTag<float, 8> d8;
    return hn::Combine(d, hn::Combine(d8, hn::LoadU(d4, field(*nodes[3])), hn::LoadU(d4, field(*nodes[2]))),
                       hn::Combine(d8, hn::LoadU(d4, field(*nodes[1])), hn::LoadU(d4, field(*nodes[0]))));
  } else if constexpr (hn::MaxLanes(d) == 8) {
    return hn::Combine(d, hn::LoadU(d4, field(*nodes[first + 1])), hn::LoadU(d4, field(*nodes[first])));
  } else {
    return hn::LoadU(d, field(*nodes[first]));
  }
}

/// Stores the box about a centre in steps, whose lowest is number 1.
template <class D>
HWY_INLINE void store_in_steps(D d, hn::Vec<D> centre, hn::Vec<D> half, hn::Vec<D> steps_per_metre, std::uint8_t* low,
                               std::uint8_t* high) {
  const hn::Rebind<std::int32_t, D> di;
  const hn::Rebind<std::uint8_t, D> d8;
  const auto zero = hn::Zero(d);
  const auto most = hn::Set(d, 255.0F);
  const auto from = hn::MulAdd(hn::Sub(centre, half), steps_per_metre, hn::Set(d, 1.0F));
  const auto to = hn::MulAdd(hn::Add(centre, half), steps_per_metre, hn::Set(d, 2.0F));
  hn::StoreU(hn::DemoteTo(d8, hn::ConvertTo(di, hn::Min(hn::Max(from, zero), most))), d8, low);
  hn::StoreU(hn::DemoteTo(d8, hn::ConvertTo(di, hn::Min(hn::Max(to, zero), most))), d8, high);
}

/// Of `count` pairs, rounded up to what a vector of D holds.
template <class D>
HWY_INLINE void make_pair_frames(D d, const QueryFrame& query, const Nodes& a, const Nodes& b, std::size_t count,
                                 PairFrames* frames) {
  using V = hn::Vec<D>;
  const hn::RepartitionToWide<D> d64;
  const V r0 = hn::LoadDup128(d, query.R_AB[0]);
  const V r1 = hn::LoadDup128(d, query.R_AB[1]);
  const V r2 = hn::LoadDup128(d, query.R_AB[2]);
  const V p_AB = hn::LoadDup128(d, query.p_AB);
  const auto combine = [](V x0, V x1, V x2, V v) HWY_ATTR {
    return hn::MulAdd(x2, hn::Broadcast<2>(v), hn::MulAdd(x1, hn::Broadcast<1>(v), hn::Mul(x0, hn::Broadcast<0>(v))));
  };
  const auto in_A = [&](V x, V y, V z) HWY_ATTR { return hn::MulAdd(r2, z, hn::MulAdd(r1, y, hn::Mul(r0, x))); };
  for (std::size_t i = 0; i < count; i += hn::Lanes(d) / 4) {
    const V a0 = load_of_each(d, a, i, [](const TriangleTreeNode& n) { return n.axes_x; });
    const V a1 = load_of_each(d, a, i, [](const TriangleTreeNode& n) { return n.axes_y; });
    const V a2 = load_of_each(d, a, i, [](const TriangleTreeNode& n) { return n.axes_z; });
    const V bx = load_of_each(d, b, i, [](const TriangleTreeNode& n) { return n.axes_x; });
    const V by = load_of_each(d, b, i, [](const TriangleTreeNode& n) { return n.axes_y; });
    const V bz = load_of_each(d, b, i, [](const TriangleTreeNode& n) { return n.axes_z; });
    const V origin_a = load_of_each(d, a, i, [](const TriangleTreeNode& n) { return n.origin; });
    const V origin_b = load_of_each(d, b, i, [](const TriangleTreeNode& n) { return n.origin; });
    const V half_a = load_of_each(d, a, i, [](const TriangleTreeNode& n) { return n.half_extent; });
    const V half_b = load_of_each(d, b, i, [](const TriangleTreeNode& n) { return n.half_extent; });
    const V steps_a = load_of_each(d, a, i, [](const TriangleTreeNode& n) { return n.steps_per_metre; });
    const V steps_b = load_of_each(d, b, i, [](const TriangleTreeNode& n) { return n.steps_per_metre; });

    const V c0 = combine(a0, a1, a2, in_A(hn::Broadcast<0>(bx), hn::Broadcast<0>(by), hn::Broadcast<0>(bz)));
    const V c1 = combine(a0, a1, a2, in_A(hn::Broadcast<1>(bx), hn::Broadcast<1>(by), hn::Broadcast<1>(bz)));
    const V c2 = combine(a0, a1, a2, in_A(hn::Broadcast<2>(bx), hn::Broadcast<2>(by), hn::Broadcast<2>(bz)));
    const V p_ab = combine(a0, a1, a2, hn::Sub(hn::Add(combine(r0, r1, r2, origin_b), p_AB), origin_a));
    // Transposed, by pairs of floats.
    const auto xy_low = hn::BitCast(d64, hn::InterleaveLower(d, c0, c1));
    const auto xy_high = hn::BitCast(d64, hn::InterleaveUpper(d, c0, c1));
    const auto z_low = hn::BitCast(d64, hn::InterleaveLower(d, c2, c2));
    const auto z_high = hn::BitCast(d64, hn::InterleaveUpper(d, c2, c2));
    const V b0 = hn::BitCast(d, hn::InterleaveLower(d64, xy_low, z_low));
    const V b1 = hn::BitCast(d, hn::InterleaveUpper(d64, xy_low, z_low));
    const V b2 = hn::BitCast(d, hn::InterleaveLower(d64, xy_high, z_high));

    const V diagonals = hn::Broadcast<3>(hn::Add(origin_a, origin_b));
    const V slack = hn::MulAdd(hn::Set(d, kLocalSlack), diagonals, hn::Set(d, query.slack));
    const V centre_b = hn::Add(combine(c0, c1, c2, half_b), p_ab);
    const V extent_b = hn::Add(combine(hn::Abs(c0), hn::Abs(c1), hn::Abs(c2), half_b), slack);
    const V centre_a = combine(b0, b1, b2, hn::Sub(half_a, p_ab));
    const V extent_a = hn::Add(combine(hn::Abs(b0), hn::Abs(b1), hn::Abs(b2), half_a), slack);
    const std::size_t at = 4 * i;
    store_in_steps(d, centre_b, extent_b, steps_a, frames->low_of_b + at, frames->high_of_b + at);
    store_in_steps(d, centre_a, extent_a, steps_b, frames->low_of_a + at, frames->high_of_a + at);
    hn::Store(c0, d, frames->R_ab[0] + at);
    hn::Store(c1, d, frames->R_ab[1] + at);
    hn::Store(c2, d, frames->R_ab[2] + at);
    hn::Store(b0, d, frames->R_ba[0] + at);
    hn::Store(b1, d, frames->R_ba[1] + at);
    hn::Store(b2, d, frames->R_ba[2] + at);
    hn::Store(p_ab, d, frames->p_ab + at);
    hn::Store(hn::Neg(combine(b0, b1, b2, p_ab)), d, frames->p_ba + at);
    hn::Store(slack, d, frames->slack + at);
  }
}

#endif

/// Which boxes of a node's children meet the box [low, high] in its steps.
HWY_INLINE std::uint32_t children_that_meet(const TriangleTreeNode& node, const std::uint8_t* low,
                                            const std::uint8_t* high) {
  const Bytes16 d;
  std::uint32_t meet = 0;
  for (std::size_t lane = 0; lane < 16; lane += hn::Lanes(d)) {
    auto apart = hn::Zero(d);
    for (int k = 0; k < 3; ++k) {
      apart = hn::Or(apart, hn::SaturatedSub(hn::LoadU(d, node.low[k] + lane), hn::Set(d, high[k])));
      apart = hn::Or(apart, hn::SaturatedSub(hn::Set(d, low[k]), hn::LoadU(d, node.high[k] + lane)));
    }
    meet |= mask_bits(d, hn::Eq(apart, hn::Zero(d))) << lane;
  }
  return meet;
}

/// Boxes of some children of one node of a pair, side by side.
struct ChildBoxes {
  HWY_ALIGN float centre[3][16];  ///< In the node's own frame.
  HWY_ALIGN float half[3][16];
  HWY_ALIGN float other_centre[3][16];  ///< In the frame of the other node.
  HWY_ALIGN float other_half[3][16];    ///< Of the boxes about them there, with slack.
};

/// |centre - point| - half - reach: positive where a box and the extent of another are apart along one axis.
template <class D>
HWY_INLINE hn::Vec<D> gap(D d, hn::Vec<D> centre, hn::Vec<D> half, float point, float reach) {
  return hn::Sub(hn::Abs(hn::Sub(centre, hn::Set(d, point))), hn::Add(half, hn::Set(d, reach)));
}

/// Three rows of a rotation and a translation, for the boxes of one node in the frame of the other.
struct Placement {
  const float* rows[3];
  const float* position;
  float slack;
};

/// Puts boxes, given in steps, into their own node's frame and the other's, at `lane` of `boxes`, and tells which reach
/// the other node's box, which has a corner at the origin and its centre at `mid`.
template <class D, class I = hn::Vec<hn::RebindToSigned<D>>>
HWY_INLINE std::uint32_t place_lanes(D d, const I (&low)[3], const I (&high)[3], const TriangleTreeNode& node,
                                     const Placement& X, const float* mid, std::size_t lane, ChildBoxes* boxes) {
  using V = hn::Vec<D>;
  const hn::RebindToSigned<D> di;
  V centre[3];
  V half[3];
  for (int k = 0; k < 3; ++k) {
    const V scale = hn::Set(d, half_step(node.half_extent[k]));
    centre[k] = hn::Mul(hn::ConvertTo(d, hn::Sub(hn::Add(low[k], high[k]), hn::Set(di, 2))), scale);
    half[k] = hn::Mul(hn::ConvertTo(d, hn::Sub(high[k], low[k])), scale);
    hn::Store(centre[k], d, boxes->centre[k] + lane);
    hn::Store(half[k], d, boxes->half[k] + lane);
  }
  V worst = hn::Set(d, -1.0F);
  for (int k = 0; k < 3; ++k) {
    const float* row = X.rows[k];
    V c = hn::MulAdd(centre[0], hn::Set(d, row[0]), hn::Set(d, X.position[k]));
    c = hn::MulAdd(centre[1], hn::Set(d, row[1]), c);
    c = hn::MulAdd(centre[2], hn::Set(d, row[2]), c);
    V h = hn::MulAdd(half[0], hn::Set(d, std::abs(row[0])), hn::Set(d, X.slack));
    h = hn::MulAdd(half[1], hn::Set(d, std::abs(row[1])), h);
    h = hn::MulAdd(half[2], hn::Set(d, std::abs(row[2])), h);
    hn::Store(c, d, boxes->other_centre[k] + lane);
    hn::Store(h, d, boxes->other_half[k] + lane);
    worst = hn::Max(worst, gap(d, c, h, mid[k], mid[k]));
  }
  return mask_bits(d, hn::Le(worst, hn::Zero(d))) << lane;
}

/// Places the children in `mask`.
HWY_INLINE std::uint32_t place_children(const TriangleTreeNode& node, std::uint32_t mask, const Placement& X,
                                        const float* mid, ChildBoxes* boxes) {
  const Floats16 d;
  const hn::RebindToSigned<Floats16> di;
  const hn::Rebind<std::uint8_t, Floats16> d8;
  using I = hn::Vec<hn::RebindToSigned<Floats16>>;
  std::uint32_t reach = 0;
  for (std::size_t lane = 0; lane < 16; lane += hn::Lanes(d)) {
    I low[3];
    I high[3];
    for (int k = 0; k < 3; ++k) {
      low[k] = hn::PromoteTo(di, hn::LoadU(d8, node.low[k] + lane));
      high[k] = hn::PromoteTo(di, hn::LoadU(d8, node.high[k] + lane));
    }
    reach |= place_lanes(d, low, high, node, X, mid, lane, boxes);
  }
  return reach & mask;
}

/// What the nine axes across edges need, for rows of `p` against lanes of `q`.
struct CrossTerms {
  HWY_ALIGN float row[9][16];   ///< Half extent of each box of p along axis e_i x a_k, index 3 i + k; with slack.
  HWY_ALIGN float lane[9][16];  ///< Half extent of each box of q.
};

/// R[i][k]: coordinate i in q's frame of p's axis k.
HWY_INLINE void make_cross_terms(const float* const (&R)[3], float slack, const ChildBoxes& p, const ChildBoxes& q,
                                 CrossTerms* terms) {
  const Floats16 d;
  for (std::size_t lane = 0; lane < 16; lane += hn::Lanes(d)) {
    const V16 half[3] = {hn::Load(d, p.half[0] + lane), hn::Load(d, p.half[1] + lane), hn::Load(d, p.half[2] + lane)};
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) {
        const int k1 = (k + 1) % 3;
        const int k2 = (k + 2) % 3;
        hn::Store(hn::MulAdd(half[k1], hn::Set(d, std::abs(R[i][k2])),
                             hn::MulAdd(half[k2], hn::Set(d, std::abs(R[i][k1])), hn::Set(d, slack))),
                  d, terms->row[3 * i + k] + lane);
      }
    }
  }
  for (std::size_t lane = 0; lane < 16; lane += hn::Lanes(d)) {
    const V16 half[3] = {hn::Load(d, q.half[0] + lane), hn::Load(d, q.half[1] + lane), hn::Load(d, q.half[2] + lane)};
    for (int i = 0; i < 3; ++i) {
      const int i1 = (i + 1) % 3;
      const int i2 = (i + 2) % 3;
      for (int k = 0; k < 3; ++k) {
        hn::Store(
            hn::MulAdd(half[i1], hn::Set(d, std::abs(R[i2][k])), hn::Mul(half[i2], hn::Set(d, std::abs(R[i1][k])))), d,
            terms->lane[3 * i + k] + lane);
      }
    }
  }
}

/// Which boxes of q overlap box `row` of p along the six axes of the faces.
HWY_INLINE std::uint32_t overlap_on_faces(const ChildBoxes& p, std::uint32_t row, const ChildBoxes& q) {
  const Floats16 d;
  std::uint32_t bits = 0;
  for (std::size_t lane = 0; lane < 16; lane += hn::Lanes(d)) {
    V16 worst = hn::Set(d, -1.0F);
    for (int k = 0; k < 3; ++k) {
      worst = hn::Max(worst, gap(d, hn::Load(d, q.centre[k] + lane), hn::Load(d, q.half[k] + lane),
                                 p.other_centre[k][row], p.other_half[k][row]));
      worst = hn::Max(worst, gap(d, hn::Load(d, q.other_centre[k] + lane), hn::Load(d, q.other_half[k] + lane),
                                 p.centre[k][row], p.half[k][row]));
    }
    bits |= mask_bits(d, hn::Le(worst, hn::Zero(d))) << lane;
  }
  return bits;
}

/// The same along the nine axes across edges.
HWY_INLINE std::uint32_t overlap_across_edges(const float* const (&R)[3], const CrossTerms& terms, const ChildBoxes& p,
                                              std::uint32_t row, const ChildBoxes& q) {
  const Floats16 d;
  std::uint32_t bits = 0;
  for (std::size_t lane = 0; lane < 16; lane += hn::Lanes(d)) {
    V16 apart[3];
    for (int k = 0; k < 3; ++k) apart[k] = hn::Sub(hn::Load(d, q.centre[k] + lane), hn::Set(d, p.other_centre[k][row]));
    V16 worst = hn::Set(d, -1.0F);
    for (int i = 0; i < 3; ++i) {
      const int i1 = (i + 1) % 3;
      const int i2 = (i + 2) % 3;
      for (int k = 0; k < 3; ++k) {
        const V16 along = hn::MulSub(apart[i2], hn::Set(d, R[i1][k]), hn::Mul(apart[i1], hn::Set(d, R[i2][k])));
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
