// SPDX-License-Identifier: Apache-2.0
// A balanced tree of axis-aligned boxes over small items (points, triangles) for nearest queries. Nodes lie in heap
// order, every leaf at the same depth, so no links are stored.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
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

  /// Calls leaf(begin, end) for ranges of order() whose box is nearer to q than the square root of `bound_squared`,
  /// nearest child first. `leaf` may lower `bound_squared`, which prunes the rest; a negative value ends the search.
  template <class Leaf>
  void search(const Vector3d& q, double& bound_squared, const Leaf& leaf) const {
    struct Entry {
      std::uint32_t node;
      double squared;
    };
    std::array<Entry, kMaxDepth + 2> stack;
    std::size_t size = 0;
    stack[size++] = {1, squared_distance(1, q)};
    while (size > 0) {
      const Entry entry = stack[--size];
      if (entry.squared >= bound_squared) continue;
      if (entry.node >= first_leaf_) {
        leaf(leaf_begin_[entry.node - first_leaf_], leaf_begin_[entry.node - first_leaf_ + 1]);
        continue;
      }
      const std::uint32_t left = 2 * entry.node;
      const Entry a{left, squared_distance(left, q)};
      const Entry b{left + 1, squared_distance(left + 1, q)};
      const bool left_first = a.squared <= b.squared;
      stack[size++] = left_first ? b : a;
      stack[size++] = left_first ? a : b;
    }
  }

 private:
  static constexpr std::size_t kMaxDepth = 32;

  double squared_distance(std::uint32_t node, const Vector3d& q) const {
    const ItemBox& box = boxes_[node];
    double sum = 0.0;
    for (int i = 0; i < 3; ++i) {
      const double below = box.low[i] - q[i];
      const double above = q[i] - box.high[i];
      const double outside = below > above ? below : above;
      sum += outside > 0.0 ? outside * outside : 0.0;
    }
    return sum;
  }
  void build(const std::vector<ItemBox>& items, std::uint32_t node, std::size_t begin, std::size_t end);

  std::vector<std::uint32_t> order_;
  std::vector<ItemBox> boxes_;             // Index 1 is the root, 2n and 2n + 1 are the children of n.
  std::vector<std::uint32_t> leaf_begin_;  // One more than there are leaves.
  std::uint32_t first_leaf_ = 1;
};

}  // namespace prescene::geometry
