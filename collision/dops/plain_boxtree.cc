// SPDX-License-Identifier: Apache-2.0
#include "plain_boxtree.h"

#include <utility>

#include "prescene/core/check.h"

namespace prescene::collision {
namespace {

using Node = PlainBoxtree::Node;

std::unique_ptr<Node> make_node(const Hierarchy& shape, const std::vector<BoxtreeBox>& exact, std::uint32_t number,
                                BoxtreeBox box, std::size_t& trimmed_count) {
  auto node = std::make_unique<Node>();
  const Hierarchy::Node& from = shape.nodes[number];
  if (from.is_leaf()) {
    node->triangle = shape.order[from.begin];
    return node;
  }
  if (is_loose(exact[number], box)) {
    box = exact[number];
    node->trimmed = std::make_unique<BoxtreeBox>(box);
    ++trimmed_count;
  }
  const BoxtreeSplit split = split_of(from, exact, box);
  node->cut = split.cut;
  for (std::size_t i = 0; i < 2; ++i)
    node->children[i] = make_node(shape, exact, split.child[i], cut_off(box, split.cut, i), trimmed_count);
  return node;
}

}  // namespace

PlainBoxtree::PlainBoxtree() = default;
PlainBoxtree::PlainBoxtree(PlainBoxtree&&) noexcept = default;
PlainBoxtree& PlainBoxtree::operator=(PlainBoxtree&&) noexcept = default;
PlainBoxtree::~PlainBoxtree() = default;

PlainBoxtree PlainBoxtree::build(std::shared_ptr<const Mesh> mesh, Builder builder, core::ThreadPool& pool) {
  PRESCENE_CHECK(mesh != nullptr);
  const std::vector<Item> items = triangle_items(*mesh);
  const Hierarchy shape = build_hierarchy(items, {.builder = builder, .branching = 2, .leaf_items = 1}, pool);
  const std::vector<BoxtreeBox> exact = exact_boxes(shape, items);
  PlainBoxtree tree;
  tree.box_ = exact[0];
  tree.root_ = make_node(shape, exact, 0, exact[0], tree.trimmed_count_);
  tree.node_count_ = shape.nodes.size();
  tree.mesh_ = std::move(mesh);
  return tree;
}

std::size_t PlainBoxtree::bytes() const {
  return node_count_ * (sizeof(Node) + 8) + trimmed_count_ * (sizeof(BoxtreeBox) + 8);
}

}  // namespace prescene::collision
