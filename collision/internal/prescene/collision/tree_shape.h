// SPDX-License-Identifier: Apache-2.0
// Whether what a file says about nodes and their children is a tree, so that queries on it end and stay inside arrays.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "prescene/collision/hierarchy.h"
#include "prescene/collision/mesh.h"

namespace prescene::collision {

class TreeShape {
 public:
  explicit TreeShape(std::size_t nodes) : depths_(nodes, kUnseen) {
    if (nodes > 0) depths_[0] = 0;
  }

  /// Nodes are visited in order; false when `child` is not one that comes after its parent and has no other, or is
  /// deeper than a hierarchy's.
  bool add_child(std::size_t parent, std::size_t child) { return add(parent, child, 1); }
  /// A second node for what is one in the hierarchy.
  bool add_continuation(std::size_t node, std::size_t continued) { return add(node, continued, 0); }
  bool add_children(std::size_t parent, std::size_t first, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      if (!add_child(parent, first + i)) return false;
    }
    return true;
  }
  bool complete() const { return std::find(depths_.begin(), depths_.end(), kUnseen) == depths_.end(); }

 private:
  static constexpr std::uint8_t kUnseen = 255;
  static_assert(kDeepestNode < kUnseen);

  bool add(std::size_t parent, std::size_t child, int levels) {
    if (child <= parent || child >= depths_.size() || depths_[child] != kUnseen) return false;
    const int depth = depths_[parent] + levels;
    if (depth > kDeepestNode) return false;  // Also of a parent that was not seen.
    depths_[child] = static_cast<std::uint8_t>(depth);
    return true;
  }

  std::vector<std::uint8_t> depths_;
};

/// Whether each triangle of the mesh occurs once; `mask` is what of an entry is its number.
inline bool has_all_triangles(std::span<const std::uint32_t> order, const Mesh& mesh,
                              std::uint32_t mask = ~std::uint32_t{0}) {
  if (order.size() != mesh.triangle_count()) return false;
  std::vector<bool> seen(order.size(), false);
  for (const std::uint32_t entry : order) {
    const std::uint32_t triangle = entry & mask;
    if (triangle >= seen.size() || seen[triangle]) return false;
    seen[triangle] = true;
  }
  return true;
}

}  // namespace prescene::collision
