// SPDX-License-Identifier: Apache-2.0
// The nodes of a PlainBoxtree, and how both kinds of Boxtree choose their cuts.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "prescene/collision/dops/boxtree.h"

namespace prescene::collision {

struct PlainBoxtree::Node {
  virtual ~Node() = default;

  BoxtreeCut cut;
  std::array<std::unique_ptr<Node>, 2> children;  ///< Low and high; null in leaves.
  std::unique_ptr<BoxtreeBox> trimmed;            ///< In place of what the parent's cut gives; mostly null.
  std::uint32_t triangle = 0;                     ///< Of a leaf.
};

/// How the items of a node of a hierarchy lie in the node's box.
struct BoxtreeSplit {
  BoxtreeCut cut;                           ///< Exact.
  std::array<std::uint32_t, 2> child = {};  ///< Node of the hierarchy at the low end and at the high end.
};

/// The boxes around the triangles of each node.
std::vector<BoxtreeBox> exact_boxes(const Hierarchy& shape, const std::vector<Item>& items);
/// The axis and the order of the two children that make their boxes' areas smallest.
BoxtreeSplit split_of(const Hierarchy::Node& node, const std::vector<BoxtreeBox>& exact, const BoxtreeBox& box);
/// Whether a node whose exact box is the first one, in the second, is worth trimming.
bool is_loose(const BoxtreeBox& exact, const BoxtreeBox& box);
/// A child's box.
inline BoxtreeBox cut_off(const BoxtreeBox& box, const BoxtreeCut& cut, std::size_t child) {
  BoxtreeBox part = box;
  (child == 0 ? part.high : part.low)[cut.axis] = child == 0 ? cut.low_child_high : cut.high_child_low;
  return part;
}

}  // namespace prescene::collision
