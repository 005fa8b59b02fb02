// SPDX-License-Identifier: Apache-2.0
// Where two nodes of TriangleTrees are in each other's frames, for a few pairs at a time. Included once for each
// instruction set.
#if defined(PRESCENE_COLLISION_PAIR_FRAMES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef PRESCENE_COLLISION_PAIR_FRAMES_INL_H_
#undef PRESCENE_COLLISION_PAIR_FRAMES_INL_H_
#else
#define PRESCENE_COLLISION_PAIR_FRAMES_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "prescene/collision/transform.h"
#include "prescene/collision/triangle_tree.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::collision::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Sixteen bytes at once to look at all children of a node, eight floats at once for those that are left.
using Bytes16 = hn::CappedTag<std::uint8_t, 16>;
using Floats16 = hn::CappedTag<float, 16>;
using OneBlock = hn::CappedTag<float, 4>;
using V16 = hn::Vec<Floats16>;

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

}  // namespace prescene::collision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
