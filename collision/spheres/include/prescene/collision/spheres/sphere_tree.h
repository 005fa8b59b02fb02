// SPDX-License-Identifier: Apache-2.0
// Inner sphere trees [Weller and Zachmann 2011]: a tree of bounding spheres over the spheres of a packing, with 4, 8 or
// 16 children a node, laid out so that a vector instruction meets all children of a node at once.
//
//   PRESCENE_TRY(std::shared_ptr<const SphereTree> tree, SphereTree::make(packing, {.branching = 16}, pool));
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "prescene/collision/array.h"
#include "prescene/collision/hierarchy.h"
#include "prescene/collision/spheres/sphere_packing.h"
#include "prescene/core/parallel.h"
#include "prescene/core/status.h"

namespace prescene::collision {

struct SphereTreeOptions {
  int branching = 16;  ///< Most children of a node: 4, 8 or 16.
  /// Neural gas without weights answers a few per cent to a half faster than with the spheres' volumes as weights,
  /// which draw the children to the large spheres [Weller and Zachmann 2011].
  Builder builder = Builder::kNeuralGas;

  friend bool operator==(const SphereTreeOptions&, const SphereTreeOptions&) = default;
};

/// Node 0 is the root; its children come after it. The children of a node are either all nodes or all spheres of the
/// packing. A child node's bounding sphere stands in the lanes of its parent (the root's is root()) and bounds the
/// packing's spheres below it, not only its children's bounding spheres.
class SphereTree {
 public:
  struct Node {
    std::uint32_t first = 0;   ///< Children are first, first + 1...: nodes, or places in the order of the spheres.
    std::uint16_t count = 0;   ///< 1 to branching.
    std::uint16_t bottom = 0;  ///< 1: the children are spheres.
    bool is_bottom() const { return bottom != 0; }

    friend bool operator==(const Node&, const Node&) = default;
  };

  /// Centre coordinate of unused lanes, m: out of reach of any test that takes the distance as it is. Their radius is
  /// 0.
  static constexpr float kUnusedCentre = 1e15F;
  static constexpr std::size_t kMostBranching = 16;

  /// Fails with kInvalidInput when the branching is not 4, 8 or 16. The same for any number of threads.
  static core::Result<std::shared_ptr<const SphereTree>> make(std::shared_ptr<const SpherePacking> packing,
                                                              const SphereTreeOptions& options, core::ThreadPool& pool);

  /// What a tree is made of besides its packing and options.
  struct Parts {
    Array<Node> nodes;
    Array<float> lanes;
    Array<std::uint32_t> order;
    PackedSphere root;
  };
  Parts parts() const { return {nodes_, lanes_, order_, root_}; }
  /// A tree from parts that were kept. Fails with kDataLoss when they don't make a tree over the packing: a count, an
  /// index or a number is out of range, or a node or sphere is below two nodes or none. That the bounding spheres bound
  /// is not looked at.
  static core::Result<std::shared_ptr<const SphereTree>> restore(std::shared_ptr<const SpherePacking> packing,
                                                                 const SphereTreeOptions& options, Parts parts);

  const SpherePacking& packing() const { return *packing_; }
  std::size_t branching() const { return static_cast<std::size_t>(options_.branching); }
  const SphereTreeOptions& options() const { return options_; }
  const Array<Node>& nodes() const { return nodes_; }
  /// 4 * branching() floats a node: the children's centre x, then y, z and radius, in the body's frame, m. Aligned to
  /// 64 bytes.
  const Array<float>& lanes() const { return lanes_; }
  const float* lanes(std::uint32_t node) const { return lanes_.data() + std::size_t{node} * 4 * branching(); }
  /// The packing's index of the sphere at a place.
  const Array<std::uint32_t>& order() const { return order_; }
  /// Bounds everything.
  const PackedSphere& root() const { return root_; }
  int depth() const { return depth_; }  ///< Nodes on the longest way down: at least 1.
  /// Of the nodes and the order, without the packing.
  std::size_t bytes() const { return nodes_.bytes() + lanes_.bytes() + order_.bytes(); }

 private:
  SphereTree() = default;

  std::shared_ptr<const SpherePacking> packing_;
  SphereTreeOptions options_;
  Array<Node> nodes_;
  Array<float> lanes_;
  Array<std::uint32_t> order_;
  PackedSphere root_;
  int depth_ = 1;
};

/// A small sphere around spheres, its radius rounded up: at most about 1 % larger than the smallest. At least one
/// sphere (checked).
PackedSphere bounding_sphere(std::span<const PackedSphere> spheres);

}  // namespace prescene::collision
