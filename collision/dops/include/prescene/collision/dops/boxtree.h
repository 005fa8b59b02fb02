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
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "prescene/collision/array.h"
#include "prescene/collision/dops/realignment.h"
#include "prescene/collision/hierarchy.h"
#include "prescene/collision/mesh.h"
#include "prescene/collision/query_scratch.h"
#include "prescene/collision/transform.h"
#include "prescene/collision/tree_file.h"
#include "prescene/core/parallel.h"
#include "prescene/core/status.h"

namespace prescene::collision {

struct BoxtreeOptions {
  Builder builder = Builder::kSurfaceAreaHeuristic;
  int leaf_items = 1;  ///< 1 to 64. With one, a node refers to its triangles without a table.

  friend bool operator==(const BoxtreeOptions&, const BoxtreeOptions&) = default;
};

/// Axis-aligned in a mesh's frame, m; x, y, z and a zero, so that it is handled as two vectors.
struct alignas(16) BoxtreeBox {
  std::array<float, 4> low = {0, 0, 0, 0};
  std::array<float, 4> high = {0, 0, 0, 0};
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
  /// that is a node comes right after its parent where it is the first such child. Of a fifth kind are nodes that only
  /// trim the box of the node right after them.
  struct Node {
    std::array<std::uint32_t, 2> child = {};  ///< Node, or the first place of the leaf's triangles.
    /// Halves: how much of the box's width along the axis is cut off for the low and for the high child. In a node that
    /// trims, `child` holds two such numbers each too, for the lower and the upper end of x and y, and this those of z.
    std::array<std::uint16_t, 2> cut = {};
    /// Axis, or kTrims: 2 bits; triangles of the low and of the high child: 7 bits each, 0: a node.
    std::uint32_t header = 0;
  };
  static_assert(sizeof(Node) == 16);
  static constexpr std::uint32_t kTrims = 3;

  /// A node, or where `triangles` > 0 a leaf of so many triangles.
  struct Child {
    std::uint32_t index = 0;
    std::uint32_t triangles = 0;
  };

  /// Options out of range are our bug (checked).
  static Boxtree build(std::shared_ptr<const Mesh> mesh, const BoxtreeOptions& options, core::ThreadPool& pool);
  /// To and from a file (tree_file.h); TreeFile::open says how reading may fail. Bad contents are kDataLoss.
  core::Status save(const std::filesystem::path& path) const;
  static core::Result<Boxtree> load(const std::filesystem::path& path, std::shared_ptr<const Mesh> mesh,
                                    const BoxtreeOptions& options);
  /// The same in memory.
  std::vector<std::uint8_t> file_bytes() const;
  static core::Result<Boxtree> from_bytes(std::span<const std::uint8_t> bytes, std::shared_ptr<const Mesh> mesh,
                                          const BoxtreeOptions& options);

  const Mesh& mesh() const { return *mesh_; }
  const BoxtreeOptions& options() const { return options_; }
  const BoxtreeBox& box() const { return box_; }
  Child root() const { return root_; }
  /// The box after shares of its width, given as halves, have been cut off its ends: in this order of roundings on
  /// every machine.
  static BoxtreeBox cut_off(const BoxtreeBox& box, const std::array<std::uint16_t, 4>& from_low,
                            const std::array<std::uint16_t, 4>& from_high);

  /// Trims the box if `child` is a node that does so, and goes on to the node that it trims for.
  void trim(Child& child, BoxtreeBox& box) const;
  std::array<Child, 2> children(const Child& node) const;
  /// The boxes of the two children of a node with this box.
  std::array<BoxtreeBox, 2> halves(const Child& node, const BoxtreeBox& box) const;
  std::uint32_t triangle(const Child& leaf, std::uint32_t i) const {
    return order_.empty() ? leaf.index + i : order_[leaf.index + i];
  }

  const Array<Node>& nodes() const { return nodes_; }
  /// Empty when leaves hold one triangle.
  const Array<std::uint32_t>& order() const { return order_; }
  /// Of nodes and triangle references.
  std::size_t bytes() const { return nodes_.bytes() + order_.bytes(); }

 private:
  Boxtree() = default;
  TreeFileWriter file() const;
  static core::Result<Boxtree> from_file(const TreeFile& file, std::shared_ptr<const Mesh> mesh,
                                         const BoxtreeOptions& options);

  std::shared_ptr<const Mesh> mesh_;
  BoxtreeOptions options_;
  BoxtreeBox box_;
  Child root_;
  Array<Node> nodes_;
  Array<std::uint32_t> order_;
};

inline BoxtreeBox Boxtree::cut_off(const BoxtreeBox& box, const std::array<std::uint16_t, 4>& from_low,
                                   const std::array<std::uint16_t, 4>& from_high) {
  BoxtreeBox part;
  for (std::size_t i = 0; i < 4; ++i) {
    const float width = box.high[i] - box.low[i];
    part.low[i] = box.low[i] + from_positive_half(from_low[i]) * width;
    part.high[i] = box.high[i] - from_positive_half(from_high[i]) * width;
  }
  return part;
}

inline void Boxtree::trim(Child& child, BoxtreeBox& box) const {
  if (child.triangles > 0) return;
  const Node& node = nodes_[child.index];
  if ((node.header & 3U) != kTrims) return;
  const auto half = [](std::uint32_t two, std::uint32_t shift) { return static_cast<std::uint16_t>(two >> shift); };
  box = cut_off(box, {half(node.child[0], 0), half(node.child[1], 0), node.cut[0], 0},
                {half(node.child[0], 16), half(node.child[1], 16), node.cut[1], 0});
  ++child.index;
}

inline std::array<Boxtree::Child, 2> Boxtree::children(const Child& node) const {
  const Node& from = nodes_[node.index];
  return {Child{from.child[0], from.header >> 2U & 0x7FU}, Child{from.child[1], from.header >> 9U & 0x7FU}};
}

inline std::array<BoxtreeBox, 2> Boxtree::halves(const Child& node, const BoxtreeBox& box) const {
  const Node& from = nodes_[node.index];
  const std::uint32_t axis = from.header & 3U;
  const float off_low_child = from_positive_half(from.cut[0]);
  const float off_high_child = from_positive_half(from.cut[1]);
  std::array<BoxtreeBox, 2> parts = {box, box};
  // As cut_off with no other cuts, and without addressing an element, which would break up the vectors.
  for (std::uint32_t i = 0; i < 4; ++i) {
    const float width = box.high[i] - box.low[i];
    parts[0].high[i] = box.high[i] - (i == axis ? off_low_child : 0.0F) * width;
    parts[1].low[i] = box.low[i] + (i == axis ? off_high_child : 0.0F) * width;
  }
  return parts;
}

class PlainBoxtree {
 public:
  struct Node;
  using Child = const Node*;

  /// Leaves of one triangle; cuts in single precision, not rounded, a trimmed box as an object of its own.
  static PlainBoxtree build(std::shared_ptr<const Mesh> mesh, Builder builder, core::ThreadPool& pool);
  PlainBoxtree(PlainBoxtree&&) noexcept;
  PlainBoxtree& operator=(PlainBoxtree&&) noexcept;
  ~PlainBoxtree();

  const Mesh& mesh() const { return *mesh_; }
  const BoxtreeBox& box() const { return box_; }
  Child root() const { return root_.get(); }
  std::size_t node_count() const { return node_count_; }
  std::size_t trimmed_count() const { return trimmed_count_; }
  /// With eight bytes an object for the heap's own.
  std::size_t bytes() const;

 private:
  PlainBoxtree();

  std::shared_ptr<const Mesh> mesh_;
  BoxtreeBox box_;
  std::unique_ptr<Node> root_;
  std::size_t node_count_ = 0;
  std::size_t trimmed_count_ = 0;
};

/// Whether a triangle of A and a triangle of B have a point in common; exact for the question of transform.h. `counts`,
/// where given, is added to.
bool collide(const Boxtree& a, const Boxtree& b, const Transform& X_AB, QueryCounts* counts = nullptr);
bool collide(const PlainBoxtree& a, const PlainBoxtree& b, const Transform& X_AB, QueryCounts* counts = nullptr);

}  // namespace prescene::collision
