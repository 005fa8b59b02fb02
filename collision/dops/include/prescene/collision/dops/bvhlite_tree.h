// SPDX-License-Identifier: Apache-2.0
// BVHLite, the quantised Doptree: k-DOPs whose planes are stored as 4, 6 or 8 bits of how far they lie inside the
// parent's planes. A node needs 8 + k bits / 8 bytes.
//
//   const BvhLiteTree cup = BvhLiteTree::build(mesh, {.k = 46, .bits = 6}, pool);
//   BvhLiteScratch scratch;
//   bool touching = collide(cup, table, X_CT, scratch);
//
// A plane is  parent's plane - (least + q step),  step = (most - least) / (2^bits - 1),  each operation rounded to
// single precision; q, least and most are chosen so that the volume contains the exact one.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "prescene/collision/array.h"
#include "prescene/collision/dops/directions.h"
#include "prescene/collision/dops/realignment.h"
#include "prescene/collision/hierarchy.h"
#include "prescene/collision/mesh.h"
#include "prescene/collision/query_scratch.h"
#include "prescene/collision/transform.h"
#include "prescene/collision/tree_file.h"
#include "prescene/core/parallel.h"
#include "prescene/core/status.h"

namespace prescene::collision {

struct BvhLiteOptions {
  int k = 46;         ///< One of kDopSizes.
  int bits = 6;       ///< Of a plane: 4, 6 or 8.
  int branching = 4;  ///< 2 to 16.
  int leaf_items = 1;
  Builder builder = Builder::kSurfaceAreaHeuristic;

  friend bool operator==(const BvhLiteOptions&, const BvhLiteOptions&) = default;
};

class BvhLiteTree {
 public:
  /// Planes in memory are in whole vectors; upper and lower plane of each axis after each other.
  static constexpr std::size_t kPlanes = 48;
  using Planes = std::array<float, kPlanes>;

  /// Bits of a node's reference, besides the first child's number or, of a leaf, the first place in order().
  static constexpr std::uint32_t kLeaf = 1U << 31U;
  static constexpr std::uint32_t kLastSibling = 1U << 30U;
  static constexpr std::uint32_t kNumber = kLastSibling - 1U;
  /// Bit of the last triangle of a leaf in order().
  static constexpr std::uint32_t kLastTriangle = 1U << 31U;

  /// Options out of range, and trees of 2^30 nodes, are our bug (checked).
  static BvhLiteTree build(std::shared_ptr<const Mesh> mesh, const BvhLiteOptions& options, core::ThreadPool& pool);
  /// To and from a file (tree_file.h); TreeFile::open says how reading may fail. Bad contents are kDataLoss.
  core::Status save(const std::filesystem::path& path) const;
  static core::Result<BvhLiteTree> load(const std::filesystem::path& path, std::shared_ptr<const Mesh> mesh,
                                        const BvhLiteOptions& options);
  /// The same in memory.
  std::vector<std::uint8_t> file_bytes() const;
  static core::Result<BvhLiteTree> from_bytes(std::span<const std::uint8_t> bytes, std::shared_ptr<const Mesh> mesh,
                                              const BvhLiteOptions& options);

  const Mesh& mesh() const { return *mesh_; }
  const BvhLiteOptions& options() const { return options_; }
  const DopSpace& space() const { return space_; }
  std::size_t node_count() const { return node_count_; }
  /// Bytes of a node: reference, least and most (halves), planes from the lowest bit on.
  std::size_t stride() const { return 8 + (static_cast<std::size_t>(options_.k * options_.bits) + 7) / 8; }
  const std::uint8_t* node(std::uint32_t i) const { return nodes_.data() + i * stride(); }
  std::uint32_t reference(std::uint32_t i) const;
  const Array<std::uint32_t>& order() const { return order_; }
  const Planes& root_planes() const { return root_planes_; }
  /// The planes of node i below a node with `parent`'s: the scalar twin of what queries do. Node 0 has root_planes().
  Planes planes_below(std::uint32_t i, const Planes& parent) const;
  /// Of nodes and triangle references.
  std::size_t bytes() const { return nodes_.bytes() + order_.bytes() + sizeof(Planes); }

 private:
  BvhLiteTree() = default;
  TreeFileWriter file() const;
  static core::Result<BvhLiteTree> from_file(const TreeFile& file, std::shared_ptr<const Mesh> mesh,
                                             const BvhLiteOptions& options);

  std::shared_ptr<const Mesh> mesh_;
  BvhLiteOptions options_;
  DopSpace space_;
  std::size_t node_count_ = 0;
  Array<std::uint8_t> nodes_;  // And 16 bytes that are read with the last one.
  Array<std::uint32_t> order_;
  Planes root_planes_ = {};
};

/// Memory that a query works in. One a thread; after the first queries nothing is allocated any more.
class BvhLiteScratch {
 public:
  /// Volumes of the children of the two nodes of one level of the descent.
  struct Level {
    alignas(64) std::array<BvhLiteTree::Planes, 16> a;
    alignas(64) std::array<BvhLiteTree::Planes, 16> b;
    alignas(64) std::array<BvhLiteTree::Planes, 16> bounds;  ///< b's, along A's directions.
  };
  Level& level(std::size_t depth) {
    while (levels_.size() <= depth) levels_.push_back(std::make_unique<Level>());
    return *levels_[depth];
  }

 private:
  std::vector<std::unique_ptr<Level>> levels_;
};

/// Whether a triangle of A and a triangle of B have a point in common; exact for the question of transform.h. Both with
/// the same k (checked). `counts`, where given, is added to.
bool collide(const BvhLiteTree& a, const BvhLiteTree& b, const Transform& X_AB, BvhLiteScratch& scratch,
             QueryCounts* counts = nullptr);

}  // namespace prescene::collision
