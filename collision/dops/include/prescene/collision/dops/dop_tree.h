// SPDX-License-Identifier: Apache-2.0
// A binary tree of k-DOPs in plain C++ [Klosowski et al. 1998; Zachmann 1998]: the baseline that the vectorised trees
// are compared with.
//
//   const DopTree cup = DopTree::build(mesh, {.k = 32}, pool);
//   bool touching = collide(cup, table, X_CT);
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

struct DopTreeOptions {
  int k = 32;  ///< One of kDopSizes.
  Builder builder = Builder::kLongestAxis;
  int leaf_items = 1;

  friend bool operator==(const DopTreeOptions&, const DopTreeOptions&) = default;
};

class DopTree {
 public:
  struct Node {
    std::uint32_t first = 0;  ///< Its two children are nodes `first` and `first` + 1; of a leaf the first of `order`.
    std::uint32_t triangles = 0;  ///< 0: not a leaf.
    bool is_leaf() const { return triangles > 0; }
  };

  /// Options out of range are our bug (checked).
  static DopTree build(std::shared_ptr<const Mesh> mesh, const DopTreeOptions& options, core::ThreadPool& pool);
  /// To and from a file (tree_file.h); TreeFile::open says how reading may fail. Bad contents are kDataLoss.
  core::Status save(const std::filesystem::path& path) const;
  static core::Result<DopTree> load(const std::filesystem::path& path, std::shared_ptr<const Mesh> mesh,
                                    const DopTreeOptions& options);
  /// The same in memory.
  std::vector<std::uint8_t> file_bytes() const;
  static core::Result<DopTree> from_bytes(std::span<const std::uint8_t> bytes, std::shared_ptr<const Mesh> mesh,
                                          const DopTreeOptions& options);

  const Mesh& mesh() const { return *mesh_; }
  const DopTreeOptions& options() const { return options_; }
  const DopSpace& space() const { return space_; }
  const Array<Node>& nodes() const { return nodes_; }
  const Array<std::uint32_t>& order() const { return order_; }
  /// The k planes of a node.
  const float* planes(std::uint32_t node) const { return planes_.data() + node * static_cast<std::size_t>(options_.k); }
  /// Of nodes, planes and triangle references.
  std::size_t bytes() const { return nodes_.bytes() + planes_.bytes() + order_.bytes(); }

 private:
  DopTree() = default;
  TreeFileWriter file() const;
  static core::Result<DopTree> from_file(const TreeFile& file, std::shared_ptr<const Mesh> mesh,
                                         const DopTreeOptions& options);

  std::shared_ptr<const Mesh> mesh_;
  DopTreeOptions options_;
  DopSpace space_;
  Array<Node> nodes_;
  Array<float> planes_;
  Array<std::uint32_t> order_;
};

/// Whether a triangle of A and a triangle of B have a point in common; exact for the question of transform.h. Both with
/// the same k (checked). `counts`, where given, is added to.
bool collide(const DopTree& a, const DopTree& b, const Transform& X_AB, QueryCounts* counts = nullptr);

}  // namespace prescene::collision
