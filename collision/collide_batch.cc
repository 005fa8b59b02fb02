// SPDX-License-Identifier: Apache-2.0
// Sixteen configurations of one pair of trees in one descent. Pairs of children are picked for their mean, with boxes
// grown by how far any of the configurations is from it; then each configuration tests the pair in a lane of its own,
// and the pair goes on with those that are left.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "prescene/collision/batch_queries.h"
#include "prescene/core/check.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "collide_batch.cc"
#include <hwy/foreach_target.h>
// After foreach_target.h, which includes this file once for each instruction set.
#include <hwy/highway.h>

#include "leaf_pairs-inl.h"
#include "pair_traversal-inl.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::collision::HWY_NAMESPACE {

constexpr std::size_t kConfigurations = 16;

/// Configurations in lanes, and what they have in common.
struct Configurations {
  HWY_ALIGN float rotation[9][kConfigurations];
  HWY_ALIGN float translation[3][kConfigurations];
  HWY_ALIGN float turn[9][kConfigurations];   ///< Rotation less that of the mean.
  HWY_ALIGN float shift[3][kConfigurations];  ///< Translation less that of the mean, m.
  Transform mean;
  float largest_turn = 0.0F;  ///< Norm of any `turn`.
  float slack = 0.0F;         ///< As in QueryFrame, for the one that is furthest away.
};

Configurations make_configurations(const TriangleTree& a, const TriangleTree& b, std::span<const Transform> X_AB,
                                   const Transform& mean) {
  Configurations lanes;
  lanes.mean = mean;
  for (std::size_t c = 0; c < kConfigurations; ++c) {
    const Transform& X = X_AB[std::min(c, X_AB.size() - 1)];
    float squares = 0.0F;
    for (std::size_t i = 0; i < 9; ++i) {
      lanes.rotation[i][c] = X.rotation[i];
      lanes.turn[i][c] = X.rotation[i] - mean.rotation[i];
      squares += lanes.turn[i][c] * lanes.turn[i][c];
    }
    lanes.largest_turn = std::max(lanes.largest_turn, std::sqrt(squares));
    for (std::size_t i = 0; i < 3; ++i) {
      lanes.translation[i][c] = X.translation[i];
      lanes.shift[i][c] = X.translation[i] - mean.translation[i];
    }
    lanes.slack = std::max(lanes.slack, make_query_frame(a, b, X).slack);
  }
  return lanes;
}

/// A box in a frame of its own, in the mesh's frame.
struct PlacedBox {
  const float* axes_x;  ///< Coordinates x of the three axes.
  const float* axes_y;
  const float* axes_z;
  float centre[3];
  float half[3];
};

HWY_INLINE PlacedBox box_in_node(const TriangleTreeNode& node, const float (&centre)[3], const float (&half)[3]) {
  PlacedBox box{node.axes_x, node.axes_y, node.axes_z, {}, {}};
  box.centre[0] = node.origin[0];
  box.centre[1] = node.origin[1];
  box.centre[2] = node.origin[2];
  for (int k = 0; k < 3; ++k) {
    box.centre[0] += node.axes_x[k] * centre[k];
    box.centre[1] += node.axes_y[k] * centre[k];
    box.centre[2] += node.axes_z[k] * centre[k];
    box.half[k] = half[k];
  }
  return box;
}

HWY_INLINE PlacedBox box_of_node(const TriangleTreeNode& node) {
  return box_in_node(node, node.half_extent, node.half_extent);
}

HWY_INLINE PlacedBox box_of_child(const TriangleTreeNode& node, std::uint32_t child) {
  float centre[3];
  float half[3];
  for (int k = 0; k < 3; ++k) {
    const float scale = half_step(node.half_extent[k]);
    centre[k] = static_cast<float>(node.low[k][child] + node.high[k][child] - 2) * scale;
    half[k] = static_cast<float>(node.high[k][child] - node.low[k][child]) * scale;
  }
  return box_in_node(node, centre, half);
}

/// The axes of node b in the frames of A and of node a, for each configuration.
struct NodeRotations {
  HWY_ALIGN float in_A[3][3][kConfigurations];  ///< [axis][coordinate]
  HWY_ALIGN float in_a[3][3][kConfigurations];
};

HWY_INLINE void make_rotations(const Configurations& lanes, const TriangleTreeNode& a, const TriangleTreeNode& b,
                               NodeRotations* rotations) {
  const Floats16 d;
  for (std::size_t lane = 0; lane < kConfigurations; lane += hn::Lanes(d)) {
    for (int m = 0; m < 3; ++m) {
      V16 in_A[3];
      for (std::size_t c = 0; c < 3; ++c) {
        V16 v = hn::Mul(hn::Load(d, lanes.rotation[3 * c] + lane), hn::Set(d, b.axes_x[m]));
        v = hn::MulAdd(hn::Load(d, lanes.rotation[3 * c + 1] + lane), hn::Set(d, b.axes_y[m]), v);
        in_A[c] = hn::MulAdd(hn::Load(d, lanes.rotation[3 * c + 2] + lane), hn::Set(d, b.axes_z[m]), v);
        hn::Store(in_A[c], d, rotations->in_A[m][c] + lane);
      }
      for (int k = 0; k < 3; ++k) {
        V16 v = hn::Mul(in_A[0], hn::Set(d, a.axes_x[k]));
        v = hn::MulAdd(in_A[1], hn::Set(d, a.axes_y[k]), v);
        hn::Store(hn::MulAdd(in_A[2], hn::Set(d, a.axes_z[k]), v), d, rotations->in_a[m][k] + lane);
      }
    }
  }
}

/// The configurations in which two boxes of the nodes of `rotations` overlap, by all 15 separating axes.
HWY_INLINE std::uint32_t overlapping_in(const Configurations& lanes, const NodeRotations& rotations, const PlacedBox& a,
                                        const PlacedBox& b, float slack) {
  const Floats16 d;
  std::uint32_t overlapping = 0;
  for (std::size_t lane = 0; lane < kConfigurations; lane += hn::Lanes(d)) {
    V16 from_A[3];
    for (std::size_t c = 0; c < 3; ++c) {
      V16 v = hn::Sub(hn::Load(d, lanes.translation[c] + lane), hn::Set(d, a.centre[c]));
      v = hn::MulAdd(hn::Load(d, lanes.rotation[3 * c] + lane), hn::Set(d, b.centre[0]), v);
      v = hn::MulAdd(hn::Load(d, lanes.rotation[3 * c + 1] + lane), hn::Set(d, b.centre[1]), v);
      from_A[c] = hn::MulAdd(hn::Load(d, lanes.rotation[3 * c + 2] + lane), hn::Set(d, b.centre[2]), v);
    }
    V16 R[3][3];  // [m][k]
    V16 abs_R[3][3];
    V16 from_a[3];
    V16 worst = hn::Set(d, -1.0F);
    for (int k = 0; k < 3; ++k) {
      V16 reach = hn::Set(d, a.half[k] + slack);
      for (int m = 0; m < 3; ++m) {
        R[m][k] = hn::Load(d, rotations.in_a[m][k] + lane);
        abs_R[m][k] = hn::Abs(R[m][k]);
        reach = hn::MulAdd(abs_R[m][k], hn::Set(d, b.half[m]), reach);
      }
      from_a[k] = hn::Mul(from_A[0], hn::Set(d, a.axes_x[k]));
      from_a[k] = hn::MulAdd(from_A[1], hn::Set(d, a.axes_y[k]), from_a[k]);
      from_a[k] = hn::MulAdd(from_A[2], hn::Set(d, a.axes_z[k]), from_a[k]);
      worst = hn::Max(worst, hn::Sub(hn::Abs(from_a[k]), reach));
    }
    for (int m = 0; m < 3; ++m) {
      V16 reach = hn::Set(d, b.half[m] + slack);
      V16 along = hn::Zero(d);
      for (int k = 0; k < 3; ++k) {
        reach = hn::MulAdd(abs_R[m][k], hn::Set(d, a.half[k]), reach);
        along = hn::MulAdd(from_a[k], R[m][k], along);
      }
      worst = hn::Max(worst, hn::Sub(hn::Abs(along), reach));
    }
    if (hn::AllFalse(d, hn::Le(worst, hn::Zero(d)))) continue;
    for (int k = 0; k < 3; ++k) {
      const int k1 = (k + 1) % 3;
      const int k2 = (k + 2) % 3;
      for (int m = 0; m < 3; ++m) {
        const int m1 = (m + 1) % 3;
        const int m2 = (m + 2) % 3;
        const V16 along = hn::MulSub(from_a[k2], R[m][k1], hn::Mul(from_a[k1], R[m][k2]));
        V16 reach = hn::MulAdd(abs_R[m][k2], hn::Set(d, a.half[k1]), hn::Set(d, slack));
        reach = hn::MulAdd(abs_R[m][k1], hn::Set(d, a.half[k2]), reach);
        reach = hn::MulAdd(abs_R[m2][k], hn::Set(d, b.half[m1]), reach);
        reach = hn::MulAdd(abs_R[m1][k], hn::Set(d, b.half[m2]), reach);
        worst = hn::Max(worst, hn::Sub(hn::Abs(along), reach));
      }
    }
    overlapping |= bits_of_mask(d, hn::Le(worst, hn::Zero(d))) << lane;
  }
  return overlapping;
}

/// How far a point of node b may be from where it is in the mean configuration, m.
HWY_INLINE float largest_displacement(const Configurations& lanes, const TriangleTreeNode& b, std::uint32_t alive) {
  const Floats16 d;
  V16 largest = hn::Zero(d);
  for (std::size_t lane = 0; lane < kConfigurations; lane += hn::Lanes(d)) {
    V16 squares = hn::Zero(d);
    for (std::size_t c = 0; c < 3; ++c) {
      V16 v = hn::Load(d, lanes.shift[c] + lane);
      v = hn::MulAdd(hn::Load(d, lanes.turn[3 * c] + lane), hn::Set(d, b.origin[0]), v);
      v = hn::MulAdd(hn::Load(d, lanes.turn[3 * c + 1] + lane), hn::Set(d, b.origin[1]), v);
      v = hn::MulAdd(hn::Load(d, lanes.turn[3 * c + 2] + lane), hn::Set(d, b.origin[2]), v);
      squares = hn::MulAdd(v, v, squares);
    }
    largest = hn::Max(largest, hn::IfThenElseZero(mask_of_bits(d, alive >> lane), squares));
  }
  constexpr float kLostBySquaring = 1e-22F;  // m: squares of less than that are no numbers of single precision
  return std::sqrt(hn::GetLane(hn::MaxOfLanes(d, largest))) + kLostBySquaring + lanes.largest_turn * b.diagonal;
}

/// The two trees, the configurations and what is known of them.
struct BatchQuery {
  const TriangleTree& tree_a;
  const TriangleTree& tree_b;
  std::span<const Transform> X_AB;
  QueryScratch* scratch;
  QueryCounts* counts;
  bool counting;       ///< Whether somebody asked for the counts.
  std::uint32_t open;  ///< Bits of the configurations that are not known to touch.
  std::uint64_t exact_tests;

  /// Tests the triangles of two leaves in a configuration that is open.
  HWY_INLINE bool leaves_touch(std::uint32_t configuration, std::uint32_t block_a, std::uint32_t block_b) {
    TriangleBlock placed_b;
    place_block(X_AB[configuration], tree_b.blocks()[block_b], &placed_b);
    if (counting) {
      counts->triangle_tests += triangles_in(tree_a.references()[block_a]) * triangles_in(tree_b.references()[block_b]);
    }
    return intersecting(tree_a.blocks()[block_a], placed_b, &exact_tests) != 0;
  }
};

/// Goes on with a pair of nodes for each of a few configurations by itself.
HWY_NOINLINE void follow_singly(const NodePair& pair, std::uint32_t configurations, BatchQuery* query) {
  for (; configurations != 0; configurations &= configurations - 1) {
    const auto c = static_cast<std::uint32_t>(std::countr_zero(configurations));
    const auto leaf = [&](const LeafPair& at) HWY_ATTR { return query->leaves_touch(c, at.block_a, at.block_b); };
    if (for_overlapping_leaves<true>(query->tree_a, query->tree_b, query->X_AB[c], pair, query->scratch, query->counts,
                                     leaf))
      query->open &= ~(1U << c);
  }
}

// With no more configurations than this, each is faster by itself: a lane costs about as much as a third of them.
constexpr int kFew = 3;

/// Bits of the configurations, of at most 16, in which the trees intersect.
std::uint32_t collide_lanes(const TriangleTree& tree_a, const TriangleTree& tree_b, std::span<const Transform> X_AB,
                            const Transform& mean, QueryScratch* scratch, QueryCounts* counts, bool counting) {
  const Configurations lanes = make_configurations(tree_a, tree_b, X_AB, mean);
  const std::uint32_t all = (1U << X_AB.size()) - 1U;
  BatchQuery batch{tree_a, tree_b, X_AB, scratch, counts, counting, all, 0};
  QueryFrame query = make_query_frame(tree_a, tree_b, mean);
  const TriangleTreeNode* nodes_a = tree_a.nodes().data();
  const TriangleTreeNode* nodes_b = tree_b.nodes().data();
  std::vector<SharedNodePair>& stack = scratch->shared_node_pairs();
  stack.clear();
  stack.push_back({roots(tree_a, tree_b), all});
  NodeRotations rotations;
  PairFrames frames;
  while (!stack.empty() && batch.open != 0) {
    NodePair pair = stack.back().pair;
    std::uint32_t alive = stack.back().configurations & batch.open;
    stack.pop_back();
    if (std::popcount(alive) <= kFew) {
      follow_singly(pair, alive, &batch);
      continue;
    }
    const TriangleTreeNode& a = nodes_a[pair.a];
    const TriangleTreeNode& b = nodes_b[pair.b];
    make_rotations(lanes, a, b, &rotations);
    const float slack = lanes.slack + kLocalSlack * (a.diagonal + b.diagonal);
    alive &= overlapping_in(lanes, rotations, box_of_node(a), box_of_node(b), slack);
    ++counts->node_pairs;
    counts->volume_tests += 16;
    if (std::popcount(alive) <= kFew) {
      follow_singly(pair, alive, &batch);
      continue;
    }
    query.slack = lanes.slack + largest_displacement(lanes, b, alive);
    const Nodes only_a = {&a, &a, &a, &a};
    const Nodes only_b = {&b, &b, &b, &b};
    make_pair_frames(OneBlock(), query, only_a, only_b, 1, &frames);
    pair.a_children &= static_cast<std::uint16_t>(children_that_meet(a, frames.low_of_b, frames.high_of_b));
    pair.b_children &= static_cast<std::uint16_t>(children_that_meet(b, frames.low_of_a, frames.high_of_a));
    if (pair.a_children == 0 || pair.b_children == 0) continue;
    const auto push = [&](const NodePair& below) { stack.push_back({below, alive}); };
    const auto leaf = [&](const LeafPair& at) HWY_ATTR {
      std::uint32_t rest =
          alive & batch.open &
          overlapping_in(lanes, rotations, box_of_child(a, at.child_a), box_of_child(b, at.child_b), slack);
      counts->volume_tests += 16;
      for (; rest != 0; rest &= rest - 1) {
        const auto c = static_cast<std::uint32_t>(std::countr_zero(rest));
        if (batch.leaves_touch(c, at.block_a, at.block_b)) batch.open &= ~(1U << c);
      }
      return batch.open == 0;
    };
    descend<true>(pair, frames, 0, nodes_a, nodes_b, counts, push, leaf);
  }
  counts->exact_tests += batch.exact_tests;
  return all & ~batch.open;
}

}  // namespace prescene::collision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace prescene::collision {
namespace {

/// The mean translation, and the rotation nearest to the mean matrix up to what one step of orthogonalisation leaves.
Transform mean_of(std::span<const Transform> X_AB) {
  Eigen::Matrix3d R = Eigen::Matrix3d::Zero();
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  for (const Transform& X : X_AB) {
    for (int i = 0; i < 9; ++i) R(i / 3, i % 3) += static_cast<double>(X.rotation[static_cast<std::size_t>(i)]);
    for (int i = 0; i < 3; ++i) p[i] += static_cast<double>(X.translation[static_cast<std::size_t>(i)]);
  }
  p /= static_cast<double>(X_AB.size());
  Eigen::Vector3d x = R.row(0).transpose();
  Eigen::Vector3d y = R.row(1).transpose();
  if (!(x.norm() > 0.0)) x = Eigen::Vector3d::UnitX();
  x.normalize();
  y -= x * x.dot(y);
  if (!(y.norm() > 0.0)) y = x.unitOrthogonal();
  y.normalize();
  const Eigen::Vector3d z = x.cross(y);
  Transform mean;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    mean.rotation[i] = static_cast<float>(x[k]);
    mean.rotation[3 + i] = static_cast<float>(y[k]);
    mean.rotation[6 + i] = static_cast<float>(z[k]);
    mean.translation[i] = static_cast<float>(p[k]);
  }
  return mean;
}

}  // namespace

HWY_EXPORT(collide_lanes);

void collide(const TriangleTree& a, const TriangleTree& b, std::span<const Transform> X_AB, std::span<bool> touching,
             QueryScratch& scratch, QueryCounts* counts) {
  PRESCENE_CHECK(touching.size() == X_AB.size());
  constexpr std::size_t kAtOnce = 16;
  QueryCounts unused;
  for (std::size_t first = 0; first < X_AB.size(); first += kAtOnce) {
    const std::span<const Transform> some = X_AB.subspan(first, std::min(kAtOnce, X_AB.size() - first));
    const std::uint32_t hits = HWY_DYNAMIC_DISPATCH(collide_lanes)(
        a, b, some, mean_of(some), &scratch, counts != nullptr ? counts : &unused, counts != nullptr);
    for (std::size_t i = 0; i < some.size(); ++i) touching[first + i] = (hits >> i & 1U) != 0;
  }
}

}  // namespace prescene::collision
#endif
