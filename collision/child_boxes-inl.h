// SPDX-License-Identifier: Apache-2.0
// The boxes of the children of two nodes against each other, one against sixteen, by the separating axes of two boxes
// [Gottschalk et al. 1996]. Included once for each instruction set.
#if defined(PRESCENE_COLLISION_CHILD_BOXES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef PRESCENE_COLLISION_CHILD_BOXES_INL_H_
#undef PRESCENE_COLLISION_CHILD_BOXES_INL_H_
#else
#define PRESCENE_COLLISION_CHILD_BOXES_INL_H_
#endif

#include <hwy/highway.h>

#include <cmath>

#include "pair_frames-inl.h"
#include "prescene/collision/lanes-inl.h"
#include "prescene/collision/triangle_tree.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::collision::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

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
    meet |= bits_of_mask(d, hn::Eq(apart, hn::Zero(d))) << lane;
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
  return bits_of_mask(d, hn::Le(worst, hn::Zero(d))) << lane;
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
    bits |= bits_of_mask(d, hn::Le(worst, hn::Zero(d))) << lane;
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
    bits |= bits_of_mask(d, hn::Le(worst, hn::Zero(d))) << lane;
  }
  return bits;
}

}  // namespace prescene::collision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
