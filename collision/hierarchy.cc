// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/hierarchy.h"

#include <algorithm>
#include <utility>

#include "hierarchy_splitter.h"
#include "prescene/core/check.h"

namespace prescene::collision {
namespace {

using Node = Hierarchy::Node;

// Ranges up to this size are grown by one thread: few enough to spread well, large enough to be worth a task.
constexpr std::uint32_t kSubtreeItems = 4096;

struct Grower {
  Splitter& splitter;
  std::uint32_t leaf_items;
  std::uint32_t branching;

  Cuts cut(const Node& node, int depth) const {
    if (depth < kDeepestBuilderCut) return splitter.split(node.begin, node.end);
    const std::uint32_t leaves = (node.end - node.begin + leaf_items - 1) / leaf_items;
    return equal_cuts(node.begin, node.end, std::min(branching, leaves));
  }
  bool is_leaf(const Node& node) const { return node.end - node.begin <= leaf_items; }
};

void add_children(std::vector<Node>& nodes, std::size_t parent, const Cuts& cuts) {
  nodes[parent].first_child = static_cast<std::uint32_t>(nodes.size());
  nodes[parent].child_count = cuts.parts;
  for (std::uint32_t i = 0; i < cuts.parts; ++i) nodes.push_back({.begin = cuts.at[i], .end = cuts.at[i + 1]});
}

// Below nodes[root], depth first, so that what is visited together lies together.
void grow_subtree(const Grower& grower, std::vector<Node>& nodes, std::size_t root, int depth) {
  if (grower.is_leaf(nodes[root])) return;
  const Cuts cuts = grower.cut(nodes[root], depth);
  add_children(nodes, root, cuts);
  const std::size_t first = nodes[root].first_child;
  for (std::uint32_t i = 0; i < cuts.parts; ++i) grow_subtree(grower, nodes, first + i, depth + 1);
}

struct Root {
  std::size_t node = 0;
  int depth = 0;
};

// The nodes of more than kSubtreeItems items and their children, level by level. Returns the smaller ones.
std::vector<Root> grow_top(const Grower& grower, std::vector<Node>& nodes, core::ThreadPool& pool) {
  std::vector<Root> small;
  std::vector<std::size_t> level = {0};
  for (int depth = 0; !level.empty(); ++depth) {
    std::vector<std::size_t> large;
    for (const std::size_t i : level) {
      if (nodes[i].end - nodes[i].begin > kSubtreeItems) {
        large.push_back(i);
      } else {
        small.push_back({i, depth});
      }
    }
    std::vector<Cuts> cuts(large.size());
    pool.for_each_index(large.size(), [&](std::size_t i) { cuts[i] = grower.cut(nodes[large[i]], depth); });
    level.clear();
    for (std::size_t i = 0; i < large.size(); ++i) {
      add_children(nodes, large[i], cuts[i]);
      for (std::uint32_t k = 0; k < cuts[i].parts; ++k) level.push_back(nodes[large[i]].first_child + k);
    }
  }
  std::sort(small.begin(), small.end(),
            [&](const Root& a, const Root& b) { return nodes[a.node].begin < nodes[b.node].begin; });
  return small;
}

// Puts the subtrees behind the top of the tree, in the order of their items.
void join(std::vector<Node>& nodes, const std::vector<Root>& roots, const std::vector<std::vector<Node>>& subtrees,
          core::ThreadPool& pool) {
  std::vector<std::size_t> offsets(roots.size());
  std::size_t size = nodes.size();
  for (std::size_t i = 0; i < roots.size(); ++i) {
    offsets[i] = size;
    size += subtrees[i].size() - 1;
  }
  nodes.resize(size);
  pool.for_each_index(roots.size(), [&](std::size_t i) {
    const auto moved = [&](Node node) {
      if (!node.is_leaf()) node.first_child += static_cast<std::uint32_t>(offsets[i]) - 1;
      return node;
    };
    nodes[roots[i].node] = moved(subtrees[i][0]);
    for (std::size_t k = 1; k < subtrees[i].size(); ++k) nodes[offsets[i] + k - 1] = moved(subtrees[i][k]);
  });
}

std::unique_ptr<Splitter> make_splitter(std::span<const Item> items, const HierarchyOptions& options,
                                        core::ThreadPool& pool) {
  switch (options.builder) {
    case Builder::kLongestAxis:
    case Builder::kExtendedLongestAxis:
    case Builder::kMiddle:
    case Builder::kMedian:
      return axis_splitter(items, options);
    case Builder::kSurfaceAreaHeuristic:
      return surface_area_splitter(items, options, pool);
    case Builder::kNeuralGas:
    case Builder::kWeightedNeuralGas:
      return neural_gas_splitter(items, options);
  }
  PRESCENE_CHECK(!"a builder");
}

}  // namespace

std::string_view to_string(Builder builder) {
  switch (builder) {
    case Builder::kLongestAxis:
      return "longest axis";
    case Builder::kExtendedLongestAxis:
      return "extended longest axis";
    case Builder::kMiddle:
      return "middle";
    case Builder::kMedian:
      return "median";
    case Builder::kSurfaceAreaHeuristic:
      return "surface area heuristic";
    case Builder::kNeuralGas:
      return "neural gas";
    case Builder::kWeightedNeuralGas:
      return "weighted neural gas";
  }
  PRESCENE_CHECK(!"a builder");
}

Cuts equal_cuts(std::uint32_t begin, std::uint32_t end, std::uint32_t parts) {
  Cuts cuts;
  cuts.parts = parts;
  for (std::uint32_t i = 0; i <= parts; ++i)
    cuts.at[i] = begin + static_cast<std::uint32_t>(std::uint64_t{end - begin} * i / parts);
  return cuts;
}

Hierarchy build_hierarchy(std::span<const Item> items, const HierarchyOptions& options, core::ThreadPool& pool) {
  PRESCENE_CHECK(!items.empty());
  return grow_hierarchy(*make_splitter(items, options, pool), static_cast<std::uint32_t>(items.size()), options, pool);
}

Hierarchy grow_hierarchy(Splitter& splitter, std::uint32_t count, const HierarchyOptions& options,
                         core::ThreadPool& pool) {
  PRESCENE_CHECK(count <= 1U << kMostItemsBits);
  PRESCENE_CHECK(options.branching >= 2 && options.branching <= kMostChildren);
  PRESCENE_CHECK(options.leaf_items >= 1 && options.leaf_items <= 64);
  const Grower grower{splitter, static_cast<std::uint32_t>(options.leaf_items),
                      static_cast<std::uint32_t>(options.branching)};

  Hierarchy tree;
  tree.nodes.push_back({.begin = 0, .end = count});
  const std::vector<Root> roots = grow_top(grower, tree.nodes, pool);
  std::vector<std::vector<Node>> subtrees(roots.size());
  pool.for_each_index(roots.size(), [&](std::size_t i) {
    subtrees[i].reserve(2 * (tree.nodes[roots[i].node].end - tree.nodes[roots[i].node].begin) / grower.leaf_items + 1);
    subtrees[i].push_back(tree.nodes[roots[i].node]);
    grow_subtree(grower, subtrees[i], 0, roots[i].depth);
  });
  join(tree.nodes, roots, subtrees, pool);

  tree.order.resize(count);
  pool.for_blocks(count, std::size_t{1} << 14U, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) tree.order[i] = splitter.item(i);
  });
  return tree;
}

std::vector<Item> triangle_items(const Mesh& mesh) {
  std::vector<Item> items(mesh.triangle_count());
  for (std::uint32_t i = 0; i < mesh.triangle_count(); ++i) {
    const auto [a, b, c] = mesh.corners(i);
    const Vector3f low = a.cwiseMin(b).cwiseMin(c);
    const Vector3f high = a.cwiseMax(b).cwiseMax(c);
    const Vector3f centre = a / 3.0F + b / 3.0F + c / 3.0F;
    items[i] = {.low = {low.x(), low.y(), low.z()},
                .high = {high.x(), high.y(), high.z()},
                .centre = {centre.x(), centre.y(), centre.z()},
                .weight = 0.5F * (b - a).cross(c - a).norm()};
  }
  return items;
}

}  // namespace prescene::collision
