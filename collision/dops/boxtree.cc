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

double half_area(const BoxtreeBox& box) {
  const auto extent = [&](std::size_t i) { return static_cast<double>(box.high[i]) - static_cast<double>(box.low[i]); };
  return extent(0) * extent(1) + extent(1) * extent(2) + extent(2) * extent(0);
}

// The largest half by which `wanted` or less of the width is cut off, and for which `contains` holds.
template <class Contains>
std::uint16_t cut_share(double wanted, double width, const Contains& contains) {
  if (!(wanted > 0.0) || !(width > 0.0)) return 0;
  auto cut = static_cast<std::uint16_t>(round_up_to_half(-std::min(wanted / width, 1.0)) & 0x7FFFU);
  while (cut > 0 && !contains(cut)) --cut;
  return cut;
}

// Cuts along one axis, as Boxtree::cut_off takes them.
std::array<std::uint16_t, 4> along(std::size_t axis, std::uint16_t cut) {
  std::array<std::uint16_t, 4> cuts = {};
  cuts[axis] = cut;
  return cuts;
}

// What is to be cut off the upper end so that `high` stays inside, and off the lower end for `low`.
std::uint16_t upper_cut(const BoxtreeBox& box, std::size_t axis, float high) {
  return cut_share(static_cast<double>(box.high[axis]) - static_cast<double>(high),
                   static_cast<double>(box.high[axis] - box.low[axis]),
                   [&](std::uint16_t cut) { return Boxtree::cut_off(box, {}, along(axis, cut)).high[axis] >= high; });
}
std::uint16_t lower_cut(const BoxtreeBox& box, std::size_t axis, float low) {
  return cut_share(static_cast<double>(low) - static_cast<double>(box.low[axis]),
                   static_cast<double>(box.high[axis] - box.low[axis]),
                   [&](std::uint16_t cut) { return Boxtree::cut_off(box, along(axis, cut), {}).low[axis] <= low; });
}

class Packer {
 public:
  Packer(const Hierarchy& shape, std::vector<BoxtreeBox> exact, bool one_a_leaf)
      : shape_(shape), exact_(std::move(exact)), one_a_leaf_(one_a_leaf) {
    nodes.reserve(shape.nodes.size() / 2);
  }

  Boxtree::Child add(std::uint32_t number, BoxtreeBox box) {
    const Hierarchy::Node& from = shape_.nodes[number];
    if (from.is_leaf()) return {one_a_leaf_ ? shape_.order[from.begin] : from.begin, from.end - from.begin};
    const auto first = static_cast<std::uint32_t>(nodes.size());
    if (is_loose(exact_[number], box)) box = trim(exact_[number], box);
    const std::size_t index = nodes.size();
    nodes.emplace_back();
    const BoxtreeSplit split = split_of(from, exact_, box);
    Boxtree::Node node;
    const std::size_t axis = split.cut.axis;
    node.header = static_cast<std::uint32_t>(axis);
    node.cut = {upper_cut(box, axis, split.cut.low_child_high), lower_cut(box, axis, split.cut.high_child_low)};
    const std::array<BoxtreeBox, 2> boxes = {Boxtree::cut_off(box, {}, along(axis, node.cut[0])),
                                             Boxtree::cut_off(box, along(axis, node.cut[1]), {})};
    for (std::size_t i = 0; i < 2; ++i) {
      const Boxtree::Child child = add(split.child[i], boxes[i]);
      node.child[i] = child.index;
      node.header |= child.triangles << (2 + 7 * i);
    }
    nodes[index] = node;
    return {first, 0};
  }

  std::vector<Boxtree::Node> nodes;

 private:
  // Adds a node that trims the box; returns what is left.
  BoxtreeBox trim(const BoxtreeBox& exact, const BoxtreeBox& box) {
    std::array<std::uint16_t, 4> low = {};
    std::array<std::uint16_t, 4> high = {};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = lower_cut(box, axis, exact.low[axis]);
      high[axis] = upper_cut(box, axis, exact.high[axis]);
    }
    const auto two = [&](std::size_t i) { return low[i] | static_cast<std::uint32_t>(high[i]) << 16U; };
    nodes.push_back({.child = {two(0), two(1)}, .cut = {low[2], high[2]}, .header = Boxtree::kTrims});
    return Boxtree::cut_off(box, low, high);
  }

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
    const auto add = [&](const auto& low, const auto& high) {
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

bool is_loose(const BoxtreeBox& exact, const BoxtreeBox& box) {
  constexpr double kLoose = 0.6;  // Of the area: looser ones save less memory than they cost time.
  return half_area(exact) < kLoose * half_area(box);
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
  PRESCENE_CHECK(mesh != nullptr);
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

}  // namespace prescene::collision
