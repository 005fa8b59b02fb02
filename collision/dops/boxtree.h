// SPDX-License-Identifier: Apache-2.0
// The Boxtree [Zachmann 2002]: a binary tree in which a child's box is its parent's box cut off along one axis, so that
// a node needs two numbers. Packed into 16 bytes a node; PlainBoxtree is the same tree of heap objects with pointers,
// to compare with.
//
//   const Boxtree cup = Boxtree::build(mesh, {}, pool);
//   bool touching = collide(cup, table, X_CT);
#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include "prescene/collision/array.h"
#include "prescene/collision/hierarchy.h"
#include "prescene/collision/mesh.h"
#include "prescene/collision/query_scratch.h"
#include "prescene/collision/transform.h"
#include "prescene/core/parallel.h"

namespace prescene::collision {

struct BoxtreeOptions {
  Builder builder = Builder::kSurfaceAreaHeuristic;
  int leaf_items = 1;  ///< 1 to 64. With one, a node refers to its triangles without a table.

  friend bool operator==(const BoxtreeOptions&, const BoxtreeOptions&) = default;
};

/// Axis-aligned in a mesh's frame, m.
struct BoxtreeBox {
  std::array<float, 3> low = {0, 0, 0};
  std::array<float, 3> high = {0, 0, 0};
};

/// Where a box is cut to get its two children's boxes.
struct BoxtreeCut {
  std::size_t axis = 0;
  float low_child_high = 0.0F;  ///< Upper end of the child at the lower end, m.
  float high_child_low = 0.0F;  ///< Lower end of the other, m. The two may overlap or leave a gap.
};

class Boxtree {
 public:
  /// Children that are leaves have no node of their own: four kinds of nodes, by which of the two are leaves. A child
  /// that is a node comes right after its parent where it is the first such child.
  struct Node {
    std::uint32_t header = 0;  ///< Axis: 2 bits; triangles of the low and of the high child: 7 bits each, 0: a node.
    std::array<std::uint32_t, 2> child = {};  ///< Node, or the first place of the leaf's triangles.
    /// Halves: how much of the box's width along the axis is cut off for the low and for the high child.
    std::array<std::uint16_t, 2> cut = {};
  };
  static_assert(sizeof(Node) == 16);

  /// A node, or where `triangles` > 0 a leaf of so many triangles.
  struct Child {
    std::uint32_t index = 0;
    std::uint32_t triangles = 0;
  };

  /// Options out of range are our bug (checked).
  static Boxtree build(std::shared_ptr<const Mesh> mesh, const BoxtreeOptions& options, core::ThreadPool& pool);

  const Mesh& mesh() const { return *mesh_; }
  const BoxtreeOptions& options() const { return options_; }
  const BoxtreeBox& box() const { return box_; }
  Child root() const { return root_; }
  std::array<Child, 2> children(const Child& node) const;
  /// Rounded outward: what a node's volume is, bit for bit, on every machine.
  BoxtreeCut cut(const Child& node, const BoxtreeBox& box) const;
  std::uint32_t triangle(const Child& leaf, std::uint32_t i) const {
    return order_.empty() ? leaf.index + i : order_[leaf.index + i];
  }

  const Array<Node>& nodes() const { return nodes_; }
  /// Empty when leaves hold one triangle.
  const Array<std::uint32_t>& order() const { return order_; }
  /// Of nodes and triangle references.
  std::size_t bytes() const { return nodes_.bytes() + order_.bytes(); }

 private:
  std::shared_ptr<const Mesh> mesh_;
  BoxtreeOptions options_;
  BoxtreeBox box_;
  Child root_;
  Array<Node> nodes_;
  Array<std::uint32_t> order_;
};

class PlainBoxtree {
 public:
  struct Node;
  using Child = const Node*;

  /// Leaves of one triangle; cuts in single precision, not rounded.
  static PlainBoxtree build(std::shared_ptr<const Mesh> mesh, Builder builder, core::ThreadPool& pool);
  PlainBoxtree(PlainBoxtree&&) noexcept;
  PlainBoxtree& operator=(PlainBoxtree&&) noexcept;
  ~PlainBoxtree();

  const Mesh& mesh() const { return *mesh_; }
  const BoxtreeBox& box() const { return box_; }
  Child root() const { return root_.get(); }
  std::size_t node_count() const { return node_count_; }
  /// With eight bytes an object for the heap's own.
  std::size_t bytes() const;

 private:
  PlainBoxtree();

  std::shared_ptr<const Mesh> mesh_;
  BoxtreeBox box_;
  std::unique_ptr<Node> root_;
  std::size_t node_count_ = 0;
};

/// Whether a triangle of A and a triangle of B have a point in common; exact for the question of transform.h. `counts`,
/// where given, is added to.
bool collide(const Boxtree& a, const Boxtree& b, const Transform& X_AB, QueryCounts* counts = nullptr);
bool collide(const PlainBoxtree& a, const PlainBoxtree& b, const Transform& X_AB, QueryCounts* counts = nullptr);

}  // namespace prescene::collision
