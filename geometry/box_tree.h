// SPDX-License-Identifier: Apache-2.0
// A balanced tree of axis-aligned boxes over small items (points, triangles) for nearest queries. Nodes lie in heap
// order, every leaf at the same depth, so no links are stored.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "prescene/geometry/pose.h"

namespace prescene::geometry {

class BoxTree {
 public:
  struct ItemBox {
    Vector3d low;
    Vector3d high;
  };

  BoxTree() = default;
  /// At least one item; a leaf holds at most `leaf_size`. Deterministic: ties are broken by index.
  BoxTree(const std::vector<ItemBox>& items, std::size_t leaf_size);

  /// The items' indices in the order of the leaves: neighbours in it are near each other.
  const std::vector<std::uint32_t>& order() const { return order_; }

  /// Calls leaf(i, leaf_begins()[i]) for the leaves i whose box is nearer to q than the square root of `bound_squared`,
  /// nearest child first. Distances to items that are summed in the same order, x^2 + (y^2 + z^2), are never below
  /// their box's by rounding. `leaf` may lower `bound_squared`, which prunes the rest; a negative value ends the
  /// search.
  template <class Leaf>
  void search(const Vector3d& q, double& bound_squared, const Leaf& leaf) const {
    struct Entry {
      std::uint32_t node;
      double squared;
    };
    const Eigen::Array4d padded(q.x(), q.y(), q.z(), 0.0);
    std::array<Entry, kMaxDepth + 2> stack;
    std::size_t size = 0;
    stack[size++] = {1, squared_distance(1, padded)};
    while (size > 0) {
      const Entry entry = stack[--size];
      if (entry.squared >= bound_squared) continue;
      if (entry.node >= first_leaf_) {
        leaf(entry.node - first_leaf_, leaf_begin_[entry.node - first_leaf_]);
        continue;
      }
      Entry near{2 * entry.node, squared_distance(2 * entry.node, padded)};
      Entry far{2 * entry.node + 1, squared_distance(2 * entry.node + 1, padded)};
      if (far.squared < near.squared) std::swap(near, far);
      if (far.squared < bound_squared) stack[size++] = far;
      if (near.squared < bound_squared) stack[size++] = near;
    }
  }

  /// Ranges of order() that are leaves: leaf i is [leaf_begins()[i], leaf_begins()[i + 1]).
  const std::vector<std::uint32_t>& leaf_begins() const { return leaf_begin_; }

 private:
  static constexpr std::size_t kMaxDepth = 32;

  // Padded to four numbers, so that the compiler's two-number registers are full.
  struct Node {
    Eigen::Array4d low;
    Eigen::Array4d high;
  };

  double squared_distance(std::uint32_t node, const Eigen::Array4d& q) const {
    const Node& box = nodes_[node];
    const Eigen::Array4d squares = (box.low - q).max(q - box.high).max(0.0).square();
    return squares[0] + (squares[1] + squares[2]);
  }
  void build(const std::vector<ItemBox>& items, std::uint32_t node, std::size_t begin, std::size_t end);

  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;                // Index 1 is the root, 2n and 2n + 1 are the children of n.
  std::vector<std::uint32_t> leaf_begin_;  // One more than there are leaves.
  std::uint32_t first_leaf_ = 1;
};

}  // namespace prescene::geometry
