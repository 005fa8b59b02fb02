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

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "prescene/collision/array.h"
#include "prescene/collision/hierarchy.h"
#include "prescene/collision/mesh.h"
#include "prescene/core/parallel.h"
#include "prescene/core/status.h"

namespace prescene::collision {

struct TriangleTreeOptions {
  Builder builder = Builder::kSurfaceAreaHeuristic;
  /// Nodes may turn their boxes into the principal axes of their triangles where that makes the boxes smaller.
  bool rotated_frames = true;

  friend bool operator==(const TriangleTreeOptions&, const TriangleTreeOptions&) = default;
};

/// One node: 192 bytes, three cache lines. Boxes of children are in the node's own frame N, whose origin is a corner of
/// the node's box: along axis k, child i spans from low[k][i] - 1 to high[k][i] - 1 steps, numbers from 0 to 253, so
/// that 0 and 255 are left to say "below" and "above" all of them.
///
/// Vectors of three are loaded as four floats, so what shares their 16 bytes has kWordBit, which makes it a normal
/// float: subnormal ones would slow the arithmetic that nobody looks at.
struct alignas(64) TriangleTreeNode {
  static constexpr std::uint32_t kWordBit = 1U << 30U;

  float axes_x[3];  ///< Coordinate x, in the mesh's frame, of the three axes of N.
  std::uint32_t first_child_word;
  float axes_y[3];
  std::uint32_t first_leaf_word;
  float axes_z[3];
  std::uint32_t children_word;  ///< leaf_mask() and, from bit 16 on, the number of children.
  float origin[3];              ///< Of N in the mesh's frame, m.
  float diagonal;               ///< Of the node's box, m.
  float half_extent[3];         ///< Of the node's box: half of 253 steps, m.
  std::uint32_t unused;
  float steps_per_metre[3];
  std::uint32_t unused_too;
  std::uint8_t low[3][16];
  std::uint8_t high[3][16];

  /// Node of the first child that is not a leaf; the others follow.
  std::uint32_t first_child() const { return first_child_word & ~kWordBit; }
  /// Block of the first child that is a leaf; the others follow.
  std::uint32_t first_leaf() const { return first_leaf_word & ~kWordBit; }
  /// Bit i: child i is a leaf.
  std::uint32_t leaf_mask() const { return children_word & 0xFFFFU; }
  std::uint32_t child_count() const { return children_word >> 16U & 0x1FU; }
  /// Bit i: there is a child i.
  std::uint32_t child_mask() const { return (1U << child_count()) - 1U; }
};
static_assert(sizeof(TriangleTreeNode) == 192);
/// Half a step along an axis, m, of a node of that half extent.
inline float half_step(float half_extent) { return half_extent * (1.0F / 253.0F); }

/// Up to four triangles of a leaf, corner by corner and coordinate by coordinate; a leaf with fewer repeats its last.
struct alignas(16) TriangleBlock {
  float corners[3][3][4];  ///< [corner][x y z][triangle], m, in the mesh's frame.
};

/// Their indices in the mesh; kNoTriangle where the leaf has fewer.
using TriangleReferences = std::array<std::uint32_t, 4>;
inline constexpr std::uint32_t kNoTriangle = ~std::uint32_t{0};
inline std::uint32_t triangles_in(const TriangleReferences& leaf) {
  return static_cast<std::uint32_t>(4 - std::count(leaf.begin(), leaf.end(), kNoTriangle));
}

struct TriangleTreeMemory {
  std::size_t node_bytes = 0;
  std::size_t reference_bytes = 0;
  std::size_t triangle_bytes = 0;  ///< The copy of the triangles.
};

class TreeFile;

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

  /// Keeps the tree in a file (tree_file.h) that belongs to this mesh and these options. Fails as
  /// TreeFileWriter::write.
  core::Status save(const std::filesystem::path& path) const;
  /// The tree that save() wrote for this mesh and these options, mapped into memory: the same bits. Fails as
  /// TreeFile::open, and with kDataLoss when what is in it cannot be a tree over the mesh.
  static core::Result<TriangleTree> load(const std::filesystem::path& path, std::shared_ptr<const Mesh> mesh,
                                         const TriangleTreeOptions& options);
  /// The same in memory.
  std::vector<std::uint8_t> bytes() const;
  static core::Result<TriangleTree> from_bytes(std::span<const std::uint8_t> bytes, std::shared_ptr<const Mesh> mesh,
                                               const TriangleTreeOptions& options);

 private:
  TriangleTree() = default;
  static float radius_of(const Mesh& mesh);
  static core::Result<TriangleTree> from_file(const TreeFile& file, std::shared_ptr<const Mesh> mesh,
                                              const TriangleTreeOptions& options);

  std::shared_ptr<const Mesh> mesh_;
  TriangleTreeOptions options_;
  Array<TriangleTreeNode> nodes_;
  Array<TriangleBlock> blocks_;
  Array<TriangleReferences> references_;
  float radius_ = 0.0F;
};

}  // namespace prescene::collision
