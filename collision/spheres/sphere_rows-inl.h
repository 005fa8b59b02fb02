// SPDX-License-Identifier: Apache-2.0
// All children of one node against all of another: as many rows of one as a vector holds against the lanes of the
// other. Included once for each instruction set.
#include "prescene/collision/spheres/sphere_queries.h"
#include "sphere_pairs.h"

#if defined(PRESCENE_COLLISION_SPHERE_ROWS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef PRESCENE_COLLISION_SPHERE_ROWS_INL_H_
#undef PRESCENE_COLLISION_SPHERE_ROWS_INL_H_
#else
#define PRESCENE_COLLISION_SPHERE_ROWS_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>

HWY_BEFORE_NAMESPACE();
namespace prescene::collision::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using Tag = hn::CappedTag<float, SphereTree::kMostBranching>;
using V = hn::Vec<Tag>;
using M = hn::Mask<Tag>;
inline constexpr std::size_t kLanes = hn::MaxLanes(Tag());

/// Where the children of a node stand in the tree, in their body's frame.
struct Children {
  const float* x;
  const float* y;
  const float* z;
  const float* radius;

  PackedSphere operator[](std::size_t k) const { return {Vector3f(x[k], y[k], z[k]), radius[k]}; }
};

template <std::size_t kBranching>
HWY_INLINE Children children_of(const SphereTree& tree, std::uint32_t node) {
  const float* lanes = tree.lanes().data() + std::size_t{node} * (4 * kBranching);
  return {lanes, lanes + kBranching, lanes + 2 * kBranching, lanes + 3 * kBranching};
}

/// How the pairs of children of two nodes lie in vectors: kRows children of A in one, each in as many lanes as B has
/// children, or one child of A in kVectors.
template <std::size_t kBranching>
struct Rows {
  static constexpr std::size_t kRows = std::max<std::size_t>(1, kLanes / kBranching);
  static constexpr std::size_t kVectors = std::max<std::size_t>(1, kBranching / kLanes);
};

#if HWY_TARGET == HWY_SCALAR

template <std::size_t kBranching>
HWY_INLINE V tiled(const float* values) {
  return hn::LoadU(Tag(), values);
}

template <std::size_t kBranching>
HWY_INLINE V repeated(const float* values, std::size_t row) {
  return hn::Set(Tag(), values[row]);
}

#else

/// Children's values in lanes, again and again where a vector has more lanes than there are children.
template <std::size_t kBranching>
HWY_INLINE V tiled(const float* values) {
  const Tag d;
  if constexpr (kLanes <= kBranching) {
    return hn::LoadU(d, values);
  } else if constexpr (kBranching == 4) {
    return hn::LoadDup128(d, values);
  } else {
    const hn::Half<Tag> half;
    const auto v = hn::LoadU(half, values);
    return hn::Combine(d, v, v);
  }
}

/// The values of the children `row`, `row` + 1..., each in as many lanes as the other node has children.
template <std::size_t kBranching>
HWY_INLINE V repeated(const float* values, std::size_t row) {
  const Tag d;
  if constexpr (Rows<kBranching>::kRows == 1) {
    return hn::Set(d, values[row]);
  } else {
    const hn::RebindToSigned<Tag> di;
    const auto first = hn::Set(di, static_cast<std::int32_t>(row % 4));
    const auto index = hn::Add(hn::ShiftRight < kBranching == 4 ? 2 : 3 > (hn::Iota(di, 0)), first);
    return hn::TableLookupLanes(hn::LoadDup128(d, values + row / 4 * 4), hn::IndicesFromVec(d, index));
  }
}

#endif

/// Children of B in A's frame, in registers.
template <std::size_t kBranching>
struct PlacedChildren {
  static constexpr std::size_t kVectors = Rows<kBranching>::kVectors;
  V x[kVectors];
  V y[kVectors];
  V z[kVectors];
  V radius[kVectors];

  HWY_INLINE PackedSphere operator[](std::size_t k) const {
    const Tag d;
    HWY_ALIGN float values[4][kLanes];
    hn::Store(x[k / kLanes], d, values[0]);
    hn::Store(y[k / kLanes], d, values[1]);
    hn::Store(z[k / kLanes], d, values[2]);
    hn::Store(radius[k / kLanes], d, values[3]);
    const std::size_t i = k % kLanes;
    return {Vector3f(values[0][i], values[1][i], values[2][i]), values[3][i]};
  }
};

/// X_AB in registers.
struct TransformLanes {
  V rotation[9];
  V translation[3];

  explicit HWY_INLINE TransformLanes(const Transform& X_AB) {
    const Tag d;
    for (std::size_t i = 0; i < 9; ++i) rotation[i] = hn::Set(d, X_AB.rotation[i]);
    for (std::size_t i = 0; i < 3; ++i) translation[i] = hn::Set(d, X_AB.translation[i]);
  }
  /// A coordinate of X_AB * (x, y, z), rounded as transform.h says: nothing is fused.
  HWY_INLINE V apply(std::size_t row, V x, V y, V z) const {
    const V xy = hn::Add(hn::Mul(rotation[3 * row], x), hn::Mul(rotation[3 * row + 1], y));
    return hn::Add(hn::Add(xy, hn::Mul(rotation[3 * row + 2], z)), translation[row]);
  }
};

template <std::size_t kBranching>
HWY_INLINE PlacedChildren<kBranching> place_children(const Children& b, const TransformLanes& X_AB) {
  PlacedChildren<kBranching> placed;
  for (std::size_t v = 0; v < Rows<kBranching>::kVectors; ++v) {
    const V x = tiled<kBranching>(b.x + v * kLanes);
    const V y = tiled<kBranching>(b.y + v * kLanes);
    const V z = tiled<kBranching>(b.z + v * kLanes);
    placed.x[v] = X_AB.apply(0, x, y, z);
    placed.y[v] = X_AB.apply(1, x, y, z);
    placed.z[v] = X_AB.apply(2, x, y, z);
    placed.radius[v] = tiled<kBranching>(b.radius + v * kLanes);
  }
  return placed;
}

/// A vector of pairs: the differences of the centres, from A to B, their squared length, and the radii.
struct PairVector {
  V x_a;
  V y_a;
  V z_a;
  V radius_a;
  V radius_b;
  V dx;
  V dy;
  V dz;
  V squared;
  V reach_squared;
  M meet;
};

/// The pairs of the children `row`... of a node of A, which has `count`, with vector v of a node of B's. Unused lanes
/// of B meet nothing; those of both nodes may meet each other out there, and are left out.
template <std::size_t kBranching>
HWY_INLINE PairVector pairs_of_row(const Children& a, std::size_t count, std::size_t row,
                                   const PlacedChildren<kBranching>& b, std::size_t v, float slack) {
  const Tag d;
  PairVector pairs;
  pairs.x_a = repeated<kBranching>(a.x, row);
  pairs.y_a = repeated<kBranching>(a.y, row);
  pairs.z_a = repeated<kBranching>(a.z, row);
  pairs.radius_a = repeated<kBranching>(a.radius, row);
  pairs.radius_b = b.radius[v];
  pairs.dx = hn::Sub(b.x[v], pairs.x_a);
  pairs.dy = hn::Sub(b.y[v], pairs.y_a);
  pairs.dz = hn::Sub(b.z[v], pairs.z_a);
  pairs.squared =
      hn::Add(hn::Add(hn::Mul(pairs.dx, pairs.dx), hn::Mul(pairs.dy, pairs.dy)), hn::Mul(pairs.dz, pairs.dz));
  const V reach = hn::Add(hn::Add(pairs.radius_a, hn::Set(d, slack)), pairs.radius_b);
  pairs.reach_squared = hn::Mul(reach, reach);
  pairs.meet = hn::Le(pairs.squared, pairs.reach_squared);
  if constexpr (Rows<kBranching>::kRows > 1) {
    const std::size_t pairs_left = (count - row) * kBranching;
    if (pairs_left < kLanes) pairs.meet = hn::And(pairs.meet, hn::FirstN(d, pairs_left));
  }
  return pairs;
}

/// Calls visit(first row, first lane of B, pairs) for the pairs of the `count` children of a node of A with those of a
/// node of B, a vector at a time. `meet` says which may overlap; of spheres of the packings, without slack: which do.
template <std::size_t kBranching, class Visit>
HWY_INLINE void for_rows(const Children& a, std::size_t count, const PlacedChildren<kBranching>& b, float slack,
                         const Visit& visit) {
  for (std::size_t row = 0; row < count; row += Rows<kBranching>::kRows) {
    for (std::size_t v = 0; v < Rows<kBranching>::kVectors; ++v)
      visit(row, v * kLanes, pairs_of_row<kBranching>(a, count, row, b, v, slack));
  }
}

HWY_INLINE std::uint32_t mask_bits(M mask) {
  const Tag d;
  std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(d, mask, bytes);
  return static_cast<std::uint32_t>(bytes[0]) | (static_cast<std::uint32_t>(bytes[1]) << 8U);
}

}  // namespace prescene::collision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // PRESCENE_COLLISION_SPHERE_ROWS_INL_H_
