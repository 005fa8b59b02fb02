// SPDX-License-Identifier: Apache-2.0
#include "plain_boxtree.h"
#include "prescene/collision/dops/boxtree.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "boxtree_collide.cc"
#include <hwy/foreach_target.h>
// After foreach_target.h, which includes this file once for each instruction set.
#include <hwy/highway.h>

#include <algorithm>
#include <cmath>

#include "pair_batch-inl.h"

#ifndef PRESCENE_COLLISION_DOPS_BOXTREE_COLLIDE_ONCE
#define PRESCENE_COLLISION_DOPS_BOXTREE_COLLIDE_ONCE
namespace prescene::collision {
namespace {

// The same access to both kinds of tree.
bool is_leaf(const Boxtree& /*tree*/, const Boxtree::Child& child) { return child.triangles > 0; }
bool is_leaf(const PlainBoxtree& /*tree*/, PlainBoxtree::Child child) { return child->children[0] == nullptr; }
std::uint32_t triangle_count(const Boxtree& /*tree*/, const Boxtree::Child& leaf) { return leaf.triangles; }
std::uint32_t triangle_count(const PlainBoxtree& /*tree*/, PlainBoxtree::Child /*leaf*/) { return 1; }
std::uint32_t triangle_of(const Boxtree& tree, const Boxtree::Child& leaf, std::uint32_t i) {
  return tree.triangle(leaf, i);
}
std::uint32_t triangle_of(const PlainBoxtree& /*tree*/, PlainBoxtree::Child leaf, std::uint32_t /*i*/) {
  return leaf->triangle;
}
std::array<Boxtree::Child, 2> children_of(const Boxtree& tree, const Boxtree::Child& node) {
  return tree.children(node);
}
std::array<PlainBoxtree::Child, 2> children_of(const PlainBoxtree& /*tree*/, PlainBoxtree::Child node) {
  return {node->children[0].get(), node->children[1].get()};
}
void trim(const Boxtree& tree, Boxtree::Child& child, BoxtreeBox& box) { tree.trim(child, box); }
void trim(const PlainBoxtree& /*tree*/, PlainBoxtree::Child child, BoxtreeBox& box) {
  if (child->trimmed != nullptr) box = *child->trimmed;
}
std::array<BoxtreeBox, 2> halves_of(const Boxtree& tree, const Boxtree::Child& node, const BoxtreeBox& box) {
  return tree.halves(node, box);
}
std::array<BoxtreeBox, 2> halves_of(const PlainBoxtree& /*tree*/, PlainBoxtree::Child node, const BoxtreeBox& box) {
  const BoxtreeCut cut = node->cut;
  std::array<BoxtreeBox, 2> parts = {box, box};
  for (std::size_t i = 0; i < 4; ++i) {
    parts[0].high[i] = i == cut.axis ? cut.low_child_high : box.high[i];
    parts[1].low[i] = i == cut.axis ? cut.high_child_low : box.low[i];
  }
  return parts;
}

// Four numbers that are handled as a vector.
using Four = std::array<float, 4>;

// Where B's boxes are in A's frame, and what rounding may add to the tests, m.
struct BoxtreeFrame {
  alignas(16) std::array<Four, 3> columns = {};  // Of R_AB.
  alignas(16) std::array<Four, 3> rows = {};
  alignas(16) Four t = {};
  float slack = 0.0F;        ///< Along A's axes.
  float other_slack = 0.0F;  ///< Along B's: also because they are perpendicular only up to rounding.

  BoxtreeFrame(const BoxtreeBox& a, const BoxtreeBox& b, const Transform& X_AB) {
    double reach_a = 0.0;
    double reach_b = 0.0;
    double shift = 0.0;
    double largest = 0.0;
    double skew = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      t[i] = X_AB.translation[i];
      reach_a += std::max(std::abs(static_cast<double>(a.low[i])), std::abs(static_cast<double>(a.high[i])));
      reach_b += std::max(std::abs(static_cast<double>(b.low[i])), std::abs(static_cast<double>(b.high[i])));
      shift += std::abs(static_cast<double>(t[i]));
      for (std::size_t k = 0; k < 3; ++k) {
        rows[i][k] = X_AB.rotation[3 * i + k];
        columns[k][i] = rows[i][k];
        largest = std::max(largest, std::abs(static_cast<double>(rows[i][k])));
        double product = i == k ? -1.0 : 0.0;
        for (std::size_t n = 0; n < 3; ++n)
          product += static_cast<double>(X_AB.rotation[3 * n + i]) * static_cast<double>(X_AB.rotation[3 * n + k]);
        skew = std::max(skew, std::abs(product));
      }
    }
    // Some 30 roundings, of numbers that are at most this, and of vertices of B when they are put into A's frame.
    const double sum = reach_a + shift + std::max(1.0, largest) * reach_b;
    slack = static_cast<float>(0x1p-18 * sum + 0x1p-120);
    other_slack = static_cast<float>(0x1p-18 * std::max(1.0, 3.0 * largest) * sum + 4.0 * skew * reach_b + 0x1p-120);
  }
};

}  // namespace
}  // namespace prescene::collision
#endif

HWY_BEFORE_NAMESPACE();
namespace prescene::collision::HWY_NAMESPACE {

template <class Tree>
class BoxtreeQuery {
 public:
  BoxtreeQuery(const Tree& a, const Tree& b, const Transform& X_AB, QueryCounts* counts)
      : a_(a), b_(b), frame_(a.box(), b.box(), X_AB), counts_(counts), batch_(a.mesh(), b.mesh(), X_AB, counts) {}

  bool run() {
    const SideA a = side_a(a_.root(), a_.box());
    const SideB b = seen_from_a(b_.root(), b_.box());
    return (!disjoint(a, b) && visit(a, b)) || batch_.flush();
  }

 private:
  using Child = typename Tree::Child;

  struct SideA {
    Child child;
    BoxtreeBox box;
    alignas(16) Four centre;
    alignas(16) Four half;
  };
  struct SideB {
    Child child;
    BoxtreeBox box;
    alignas(16) Four half;      // In B's frame.
    alignas(16) Four centre_A;  // In A's.
    alignas(16) Four half_A;    // Of the box around it along A's axes.
  };

  HWY_INLINE SideA side_a(Child child, BoxtreeBox box) const {
    trim(a_, child, box);
    SideA side{child, box, {}, {}};
    for (std::size_t i = 0; i < 4; ++i) {
      side.centre[i] = 0.5F * box.low[i] + 0.5F * box.high[i];
      side.half[i] = 0.5F * box.high[i] - 0.5F * box.low[i];
    }
    return side;
  }

  HWY_INLINE SideB seen_from_a(Child child, BoxtreeBox box) const {
    trim(b_, child, box);
    SideB side{child, box, {}, {}, {}};
    alignas(16) Four centre;
    for (std::size_t i = 0; i < 4; ++i) {
      centre[i] = 0.5F * box.low[i] + 0.5F * box.high[i];
      side.half[i] = 0.5F * box.high[i] - 0.5F * box.low[i];
    }
    const auto& R = frame_.columns;
    for (std::size_t i = 0; i < 4; ++i) {
      side.centre_A[i] = frame_.t[i] + R[0][i] * centre[0] + R[1][i] * centre[1] + R[2][i] * centre[2];
      side.half_A[i] = frame_.slack + std::abs(R[0][i]) * side.half[0] + std::abs(R[1][i]) * side.half[1] +
                       std::abs(R[2][i]) * side.half[2];
    }
    return side;
  }

  // By the axes of both boxes; without a branch an axis, which nobody could predict.
  HWY_INLINE bool disjoint(const SideA& a, const SideB& b) const {
    if (counts_ != nullptr) ++counts_->volume_tests;
    alignas(16) Four apart;
    int separated = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      apart[i] = b.centre_A[i] - a.centre[i];
      separated |= static_cast<int>(std::abs(apart[i]) > a.half[i] + b.half_A[i]);
    }
    if (separated != 0) return true;
    const auto& R = frame_.rows;
    for (std::size_t k = 0; k < 4; ++k) {
      const float along = R[0][k] * apart[0] + R[1][k] * apart[1] + R[2][k] * apart[2];
      const float reach = frame_.other_slack + b.half[k] + std::abs(R[0][k]) * a.half[0] +
                          std::abs(R[1][k]) * a.half[1] + std::abs(R[2][k]) * a.half[2];
      separated |= static_cast<int>(std::abs(along) > reach);
    }
    return separated != 0;
  }

  // Trees are at most kDeepestNode levels deep.
  bool visit(const SideA& a, const SideB& b) {
    if (counts_ != nullptr) ++counts_->node_pairs;
    const bool leaf_a = is_leaf(a_, a.child);
    const bool leaf_b = is_leaf(b_, b.child);
    if (leaf_a && leaf_b) return add_leaves(a.child, b.child);
    if (leaf_b) {
      const auto parts = parts_of_a(a);
      return std::any_of(parts.begin(), parts.end(),
                         [&](const SideA& part) HWY_ATTR { return !disjoint(part, b) && visit(part, b); });
    }
    const auto boxes = halves_of(b_, b.child, b.box);
    const auto children = children_of(b_, b.child);
    const std::array<SideB, 2> parts_b = {seen_from_a(children[0], boxes[0]), seen_from_a(children[1], boxes[1])};
    if (leaf_a) {
      for (const SideB& part : parts_b) {
        if (!disjoint(a, part) && visit(a, part)) return true;
      }
      return false;
    }
    for (const SideA& part_a : parts_of_a(a)) {
      for (const SideB& part_b : parts_b) {
        if (!disjoint(part_a, part_b) && visit(part_a, part_b)) return true;
      }
    }
    return false;
  }

  HWY_INLINE std::array<SideA, 2> parts_of_a(const SideA& a) const {
    const auto boxes = halves_of(a_, a.child, a.box);
    const auto children = children_of(a_, a.child);
    return {side_a(children[0], boxes[0]), side_a(children[1], boxes[1])};
  }

  HWY_INLINE bool add_leaves(const Child& a, const Child& b) {
    for (std::uint32_t i = 0; i < triangle_count(a_, a); ++i) {
      for (std::uint32_t k = 0; k < triangle_count(b_, b); ++k) {
        if (batch_.add(triangle_of(a_, a, i), triangle_of(b_, b, k))) return true;
      }
    }
    return false;
  }

  const Tree& a_;
  const Tree& b_;
  BoxtreeFrame frame_;
  QueryCounts* counts_;
  PairBatch batch_;
};

bool collide_packed(const Boxtree& a, const Boxtree& b, const Transform& X_AB, QueryCounts* counts) {
  return BoxtreeQuery<Boxtree>(a, b, X_AB, counts).run();
}
bool collide_plain(const PlainBoxtree& a, const PlainBoxtree& b, const Transform& X_AB, QueryCounts* counts) {
  return BoxtreeQuery<PlainBoxtree>(a, b, X_AB, counts).run();
}

}  // namespace prescene::collision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace prescene::collision {

HWY_EXPORT(collide_packed);
HWY_EXPORT(collide_plain);

bool collide(const Boxtree& a, const Boxtree& b, const Transform& X_AB, QueryCounts* counts) {
  return HWY_DYNAMIC_DISPATCH(collide_packed)(a, b, X_AB, counts);
}

bool collide(const PlainBoxtree& a, const PlainBoxtree& b, const Transform& X_AB, QueryCounts* counts) {
  return HWY_DYNAMIC_DISPATCH(collide_plain)(a, b, X_AB, counts);
}

}  // namespace prescene::collision
#endif
