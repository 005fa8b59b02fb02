// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/dops/boxtree.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "plain_boxtree.h"
#include "prescene/collision/dops/realignment.h"
#include "prescene/core/check.h"

namespace prescene::collision {
namespace {

constexpr std::uint32_t kCountMask = 0x7F;

double half_area(const BoxtreeBox& box) {
  const auto extent = [&](std::size_t i) { return static_cast<double>(box.high[i]) - static_cast<double>(box.low[i]); };
  return extent(0) * extent(1) + extent(1) * extent(2) + extent(2) * extent(0);
}

// The ends of the two children after a share of the box's width has been cut off.
float low_child_high(const BoxtreeBox& box, std::size_t axis, std::uint16_t cut) {
  return box.high[axis] - from_half(cut) * (box.high[axis] - box.low[axis]);
}
float high_child_low(const BoxtreeBox& box, std::size_t axis, std::uint16_t cut) {
  return box.low[axis] + from_half(cut) * (box.high[axis] - box.low[axis]);
}

// The largest half by which `wanted` or less of the width is cut off, and for which `contains` holds.
template <class Contains>
std::uint16_t cut_share(double wanted, double width, const Contains& contains) {
  if (!(wanted > 0.0) || !(width > 0.0)) return 0;
  auto cut = static_cast<std::uint16_t>(round_up_to_half(-std::min(wanted / width, 1.0)) & 0x7FFFU);
  while (cut > 0 && !contains(cut)) --cut;
  return cut;
}

std::uint16_t low_cut(const BoxtreeBox& box, const BoxtreeCut& exact) {
  const std::size_t i = exact.axis;
  return cut_share(static_cast<double>(box.high[i]) - static_cast<double>(exact.low_child_high),
                   static_cast<double>(box.high[i] - box.low[i]),
                   [&](std::uint16_t cut) { return low_child_high(box, i, cut) >= exact.low_child_high; });
}

std::uint16_t high_cut(const BoxtreeBox& box, const BoxtreeCut& exact) {
  const std::size_t i = exact.axis;
  return cut_share(static_cast<double>(exact.high_child_low) - static_cast<double>(box.low[i]),
                   static_cast<double>(box.high[i] - box.low[i]),
                   [&](std::uint16_t cut) { return high_child_low(box, i, cut) <= exact.high_child_low; });
}

class Packer {
 public:
  Packer(const Hierarchy& shape, std::vector<BoxtreeBox> exact, bool one_a_leaf)
      : shape_(shape), exact_(std::move(exact)), one_a_leaf_(one_a_leaf) {
    nodes.reserve(shape.nodes.size() / 2);
  }

  Boxtree::Child add(std::uint32_t number, const BoxtreeBox& box) {
    const Hierarchy::Node& from = shape_.nodes[number];
    if (from.is_leaf()) return {one_a_leaf_ ? shape_.order[from.begin] : from.begin, from.end - from.begin};
    const auto index = static_cast<std::uint32_t>(nodes.size());
    nodes.emplace_back();
    const BoxtreeSplit split = split_of(from, exact_, box);
    Boxtree::Node node;
    node.cut = {low_cut(box, split.cut), high_cut(box, split.cut)};
    const BoxtreeCut cut = {split.cut.axis, low_child_high(box, split.cut.axis, node.cut[0]),
                            high_child_low(box, split.cut.axis, node.cut[1])};
    node.header = static_cast<std::uint32_t>(split.cut.axis);
    for (std::size_t i = 0; i < 2; ++i) {
      const Boxtree::Child child = add(split.child[i], cut_off(box, cut, i));
      node.child[i] = child.index;
      node.header |= child.triangles << (2 + 7 * i);
    }
    nodes[index] = node;
    return {index, 0};
  }

  std::vector<Boxtree::Node> nodes;

 private:
  const Hierarchy& shape_;
  std::vector<BoxtreeBox> exact_;
  bool one_a_leaf_;
};

}  // namespace

std::vector<BoxtreeBox> exact_boxes(const Hierarchy& shape, const std::vector<Item>& items) {
  std::vector<BoxtreeBox> boxes(shape.nodes.size());
  for (std::size_t i = shape.nodes.size(); i-- > 0;) {
    const Hierarchy::Node& node = shape.nodes[i];
    bool first = true;
    const auto add = [&](const std::array<float, 3>& low, const std::array<float, 3>& high) {
      for (std::size_t c = 0; c < 3; ++c) {
        boxes[i].low[c] = first ? low[c] : std::min(boxes[i].low[c], low[c]);
        boxes[i].high[c] = first ? high[c] : std::max(boxes[i].high[c], high[c]);
      }
      first = false;
    };
    for (std::uint32_t k = 0; k < node.child_count; ++k)
      add(boxes[node.first_child + k].low, boxes[node.first_child + k].high);
    for (std::uint32_t k = node.begin; node.is_leaf() && k < node.end; ++k)
      add(items[shape.order[k]].low, items[shape.order[k]].high);
  }
  return boxes;
}

BoxtreeSplit split_of(const Hierarchy::Node& node, const std::vector<BoxtreeBox>& exact, const BoxtreeBox& box) {
  BoxtreeSplit best;
  double least = 0.0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::uint32_t low = 0; low < 2; ++low) {
      const std::array<std::uint32_t, 2> child = {node.first_child + low, node.first_child + 1 - low};
      const BoxtreeCut cut = {axis, exact[child[0]].high[axis], exact[child[1]].low[axis]};
      const double area = half_area(cut_off(box, cut, 0)) + half_area(cut_off(box, cut, 1));
      if ((axis == 0 && low == 0) || area < least) {
        least = area;
        best = {cut, child};
      }
    }
  }
  return best;
}

Boxtree Boxtree::build(std::shared_ptr<const Mesh> mesh, const BoxtreeOptions& options, core::ThreadPool& pool) {
  const std::vector<Item> items = triangle_items(*mesh);
  Hierarchy shape =
      build_hierarchy(items, {.builder = options.builder, .branching = 2, .leaf_items = options.leaf_items}, pool);
  std::vector<BoxtreeBox> exact = exact_boxes(shape, items);
  Boxtree tree;
  tree.options_ = options;
  tree.box_ = exact[0];
  Packer packer(shape, std::move(exact), options.leaf_items == 1);
  tree.root_ = packer.add(0, tree.box_);
  tree.mesh_ = std::move(mesh);
  tree.nodes_ = Array<Node>(std::move(packer.nodes));
  if (options.leaf_items > 1) tree.order_ = Array<std::uint32_t>(std::move(shape.order));
  return tree;
}

std::array<Boxtree::Child, 2> Boxtree::children(const Child& node) const {
  const Node& from = nodes_[node.index];
  return {Child{from.child[0], from.header >> 2U & kCountMask}, Child{from.child[1], from.header >> 9U & kCountMask}};
}

BoxtreeCut Boxtree::cut(const Child& node, const BoxtreeBox& box) const {
  const Node& from = nodes_[node.index];
  const std::size_t axis = from.header & 3U;
  return {axis, low_child_high(box, axis, from.cut[0]), high_child_low(box, axis, from.cut[1])};
}

}  // namespace prescene::collision
