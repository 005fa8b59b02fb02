// SPDX-License-Identifier: Apache-2.0
// The default tree over a mesh's triangles: the one to use unless a measurement says otherwise.
//
//   const TriangleTree cup = TriangleTree::build(mesh, {}, pool);
//   QueryScratch scratch;
//   bool touching = collide(cup, table, X_CT, scratch);        // triangle_queries.h
//
// Nodes have up to 16 children. Each node has a rotated frame of its own, chosen by cost, in which its children's boxes
// are axis-aligned and stored as 8-bit steps; so children are tested 16 at a time with all 15 separating axes
// [Gottschalk et al. 1996]. Leaves hold up to four triangles, copied in the order of the leaves.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "prescene/collision/array.h"
#include "prescene/collision/hierarchy.h"
#include "prescene/collision/mesh.h"
#include "prescene/core/parallel.h"

namespace prescene::collision {

struct TriangleTreeOptions {
  Builder builder = Builder::kSurfaceAreaHeuristic;
  /// Nodes may turn their boxes into the principal axes of their triangles where that makes the boxes smaller.
  bool rotated_frames = true;

  friend bool operator==(const TriangleTreeOptions&, const TriangleTreeOptions&) = default;
};

/// One node: 192 bytes, three cache lines. Boxes of children are in the node's own frame N, whose origin is the low
/// corner of the node's box: child i spans low[k][i] to high[k][i] steps along axis k.
struct alignas(64) TriangleTreeNode {
  float frame[3][4];        ///< frame[c][k]: coordinate c, in the mesh's frame, of axis k; frame[k][3]: half a step, m.
  float origin[3];          ///< Of N in the mesh's frame, m.
  std::uint16_t leaf_mask;  ///< Bit i: child i is a leaf.
  std::uint16_t child_mask;  ///< Bit i: there is a child i.
  std::uint8_t low[3][16];
  std::uint8_t high[3][16];
  std::uint32_t first_child;  ///< Node of the first child that is not a leaf; the others follow.
  std::uint32_t first_leaf;   ///< Block of the first child that is a leaf; the others follow.
  float half_extent[3];       ///< Of the node's box: half of 255 steps, m.
  float diagonal;             ///< Of the node's box, m.
  std::uint32_t unused[2];
};
static_assert(sizeof(TriangleTreeNode) == 192);

/// Up to four triangles of a leaf, corner by corner and coordinate by coordinate; a leaf with fewer repeats its last.
struct alignas(16) TriangleBlock {
  float corners[3][3][4];  ///< [corner][x y z][triangle], m, in the mesh's frame.
};

/// Their indices in the mesh; kNoTriangle where the leaf has fewer.
using TriangleReferences = std::array<std::uint32_t, 4>;
inline constexpr std::uint32_t kNoTriangle = ~std::uint32_t{0};

struct TriangleTreeMemory {
  std::size_t node_bytes = 0;
  std::size_t reference_bytes = 0;
  std::size_t triangle_bytes = 0;  ///< The copy of the triangles.
};

class TriangleTree {
 public:
  /// The same for any number of threads of `pool`.
  static TriangleTree build(std::shared_ptr<const Mesh> mesh, const TriangleTreeOptions& options,
                            core::ThreadPool& pool);

  const Mesh& mesh() const { return *mesh_; }
  const std::shared_ptr<const Mesh>& shared_mesh() const { return mesh_; }
  const TriangleTreeOptions& options() const { return options_; }
  /// Node 0 is the root.
  const Array<TriangleTreeNode>& nodes() const { return nodes_; }
  const Array<TriangleBlock>& blocks() const { return blocks_; }
  const Array<TriangleReferences>& references() const { return references_; }
  /// Largest distance of a vertex from the mesh's origin, m.
  float radius() const { return radius_; }
  TriangleTreeMemory memory() const;

 private:
  std::shared_ptr<const Mesh> mesh_;
  TriangleTreeOptions options_;
  Array<TriangleTreeNode> nodes_;
  Array<TriangleBlock> blocks_;
  Array<TriangleReferences> references_;
  float radius_ = 0.0F;
};

}  // namespace prescene::collision
