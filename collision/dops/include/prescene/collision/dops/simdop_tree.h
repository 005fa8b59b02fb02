// SPDX-License-Identifier: Apache-2.0
// SIMDop: trees of k-DOPs with up to 16 children a node, whose volumes lie in the order in which vector units test them
// [Tan et al. 2019]. Wrapped: a node's volume is tight about its triangles.
//
//   const SimdopTree cup = SimdopTree::build(mesh, {}, pool);
//   QueryScratch scratch;
//   bool touching = collide(cup, table, X_CT, scratch);
//
// Both trees of a query have the same k, branching, precision and traversal.
#pragma once

#include <array>
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

/// Which volumes one step of a test compares.
enum class SimdopTraversal {
  kOneVersusOne,   ///< Two volumes, 16 planes at a time.
  kOneVersusAll,   ///< A volume and all children of a node, one plane at a time.
  kFourVersusFour  ///< All children of two nodes, one plane at a time; branching 4 only.
};

enum class PlanePrecision { kSingle, kHalf };

struct SimdopOptions {
  int k = 26;          ///< One of kDopSizes.
  int branching = 4;   ///< 2, 4, 8 or 16.
  int leaf_items = 2;  ///< Most triangles of a leaf.
  Builder builder = Builder::kSurfaceAreaHeuristic;
  PlanePrecision precision = PlanePrecision::kHalf;
  SimdopTraversal traversal = SimdopTraversal::kOneVersusAll;

  friend bool operator==(const SimdopOptions&, const SimdopOptions&) = default;
};

class SimdopTree {
 public:
  /// An inner node. Its children are in lanes 0, 1, ...; those that are inner nodes themselves follow each other from
  /// `first_node` on, those that are leaves from `first_leaf` on.
  struct Node {
    std::uint32_t first_node = 0;
    std::uint32_t first_leaf = 0;
    std::uint16_t children = 0;  ///< A bit a lane in use.
    std::uint16_t leaves = 0;    ///< Those that are leaves.
    /// In half precision, which is finest about zero, planes are relative to this point: in units of kShift of the
    /// space's length from its centre.
    std::array<std::int8_t, 3> shift = {0, 0, 0};
  };
  static_assert(sizeof(Node) == 16);
  static constexpr float kShift = 1.0F / 256.0F;

  /// Options out of range are our bug (checked).
  static SimdopTree build(std::shared_ptr<const Mesh> mesh, const SimdopOptions& options, core::ThreadPool& pool);
  /// To and from a file (tree_file.h); TreeFile::open says how reading may fail. Bad contents are kDataLoss.
  core::Status save(const std::filesystem::path& path) const;
  static core::Result<SimdopTree> load(const std::filesystem::path& path, std::shared_ptr<const Mesh> mesh,
                                       const SimdopOptions& options);
  /// The same in memory.
  std::vector<std::uint8_t> file_bytes() const;
  static core::Result<SimdopTree> from_bytes(std::span<const std::uint8_t> bytes, std::shared_ptr<const Mesh> mesh,
                                             const SimdopOptions& options);

  const Mesh& mesh() const { return *mesh_; }
  const SimdopOptions& options() const { return options_; }
  const DopSpace& space() const { return space_; }
  const Array<Node>& nodes() const { return nodes_; }
  /// Triangles of leaf i: order()[leaf_begin()[i]] up to leaf_begin()[i + 1]; empty when leaves hold one triangle,
  /// whose place is then i.
  const Array<std::uint32_t>& leaf_begin() const { return leaf_begin_; }
  const Array<std::uint32_t>& order() const { return order_; }
  /// branching * k planes a node, of the precision's kind. A child's planes of axis i are number 2 i (upper) and
  /// 2 i + 1 (lower). Plane p of child c is at c + branching * p, but for one versus one at p + k * c.
  const Array<float>& single_planes() const { return single_planes_; }
  const Array<std::uint16_t>& half_planes() const { return half_planes_; }
  std::size_t plane_bytes() const { return single_planes_.bytes() + half_planes_.bytes(); }
  /// Of nodes, planes, leaves and triangle references.
  std::size_t bytes() const { return nodes_.bytes() + plane_bytes() + leaf_begin_.bytes() + order_.bytes(); }

 private:
  SimdopTree() = default;
  TreeFileWriter file() const;
  static core::Result<SimdopTree> from_file(const TreeFile& file, std::shared_ptr<const Mesh> mesh,
                                            const SimdopOptions& options);

  std::shared_ptr<const Mesh> mesh_;
  SimdopOptions options_;
  DopSpace space_;
  Array<Node> nodes_;
  Array<std::uint32_t> leaf_begin_;
  Array<std::uint32_t> order_;
  Array<float> single_planes_;
  Array<std::uint16_t> half_planes_;
};

/// Whether a triangle of A and a triangle of B have a point in common; exact for the question of transform.h. `counts`,
/// where given, is added to.
bool collide(const SimdopTree& a, const SimdopTree& b, const Transform& X_AB, QueryScratch& scratch,
             QueryCounts* counts = nullptr);

}  // namespace prescene::collision
