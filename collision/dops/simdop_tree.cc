// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/dops/simdop_tree.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "prescene/core/check.h"

namespace prescene::collision {
namespace {

void check(const SimdopOptions& options) {
  const int n = options.branching;
  PRESCENE_CHECK(n == 2 || n == 4 || n == 8 || n == 16);
  PRESCENE_CHECK(options.traversal != SimdopTraversal::kFourVersusFour || n == 4);
}

// A mesh of so few triangles that they fit a leaf still gets a node above it.
void add_root(Hierarchy& shape) {
  if (!shape.nodes[0].is_leaf()) return;
  Hierarchy::Node root = shape.nodes[0];
  root.first_child = 1;
  root.child_count = 1;
  shape.nodes.insert(shape.nodes.begin(), root);
}

struct Layout {
  std::vector<SimdopTree::Node> nodes;
  std::vector<std::uint32_t> shape_nodes;  // Which node of the shape a node is.
  std::vector<std::uint32_t> leaf_begin;
  std::vector<std::uint32_t> order;
};

Layout lay_out(const Hierarchy& shape) {
  Layout layout;
  std::vector<std::uint32_t> numbers(shape.nodes.size(), 0);
  for (std::uint32_t i = 0; i < shape.nodes.size(); ++i) {
    if (shape.nodes[i].is_leaf()) continue;
    numbers[i] = static_cast<std::uint32_t>(layout.shape_nodes.size());
    layout.shape_nodes.push_back(i);
  }
  layout.nodes.resize(layout.shape_nodes.size());
  for (std::size_t i = 0; i < layout.nodes.size(); ++i) {
    const Hierarchy::Node& from = shape.nodes[layout.shape_nodes[i]];
    SimdopTree::Node& to = layout.nodes[i];
    to.first_leaf = static_cast<std::uint32_t>(layout.leaf_begin.size());
    to.children = static_cast<std::uint16_t>((1U << from.child_count) - 1U);
    for (std::uint32_t lane = from.child_count; lane-- > 0;) {
      if (!shape.nodes[from.first_child + lane].is_leaf()) to.first_node = numbers[from.first_child + lane];
    }
    for (std::uint32_t lane = 0; lane < from.child_count; ++lane) {
      const Hierarchy::Node& child = shape.nodes[from.first_child + lane];
      if (!child.is_leaf()) continue;
      to.leaves = static_cast<std::uint16_t>(to.leaves | 1U << lane);
      layout.leaf_begin.push_back(static_cast<std::uint32_t>(layout.order.size()));
      layout.order.insert(layout.order.end(), shape.order.begin() + child.begin, shape.order.begin() + child.end);
    }
  }
  layout.leaf_begin.push_back(static_cast<std::uint32_t>(layout.order.size()));
  return layout;
}

// The middle of a node's volume along the coordinate axes, which are the first three.
void choose_shifts(const SimdopOptions& options, const std::vector<float>& fitted, Layout& layout) {
  const auto k = static_cast<std::size_t>(options.k);
  for (std::size_t i = 0; i < layout.nodes.size(); ++i) {
    const float* planes = &fitted[layout.shape_nodes[i] * k];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const float middle = 0.5F * (planes[axis] - planes[k / 2 + axis]);
      const float steps = std::clamp(std::round(middle / SimdopTree::kShift), -127.0F, 127.0F);
      layout.nodes[i].shift[axis] = static_cast<std::int8_t>(steps);
    }
  }
}

// Of the point that a node's planes are relative to, along each direction.
std::array<double, 2 * kMostDopAxes> shift_along(const DopDirections& directions, const SimdopTree::Node& node) {
  std::array<double, 2 * kMostDopAxes> along = {};
  for (std::size_t p = 0; p < static_cast<std::size_t>(directions.k()); ++p) {
    const DopAxis d = directions.direction(p);
    for (std::size_t c = 0; c < 3; ++c) along[p] += d[c] * static_cast<double>(SimdopTree::kShift) * node.shift[c];
  }
  return along;
}

template <class Plane, class Round>
Array<Plane> arrange(const SimdopOptions& options, const Hierarchy& shape, const Layout& layout,
                     const std::vector<float>& fitted, core::ThreadPool& pool, const Round& round) {
  const auto k = static_cast<std::size_t>(options.k);
  const auto branching = static_cast<std::size_t>(options.branching);
  const bool by_child = options.traversal == SimdopTraversal::kOneVersusOne;
  // A vector's width of slack: the last planes are loaded with what comes after them.
  std::vector<Plane> planes(layout.nodes.size() * branching * k + 16, Plane{0});
  pool.for_blocks(layout.nodes.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Hierarchy::Node& node = shape.nodes[layout.shape_nodes[i]];
      const auto shift = shift_along(DopDirections::of(options.k), layout.nodes[i]);
      Plane* to = &planes[i * branching * k];
      for (std::size_t c = 0; c < node.child_count; ++c) {
        const float* from = &fitted[(node.first_child + c) * k];
        for (std::size_t p = 0; p < k; ++p) {
          const std::size_t direction = p % 2 == 0 ? p / 2 : k / 2 + p / 2;
          to[by_child ? c * k + p : p * branching + c] = round(static_cast<double>(from[direction]) - shift[direction]);
        }
      }
    }
  });
  return Array<Plane>(std::move(planes));
}

}  // namespace

SimdopTree SimdopTree::build(std::shared_ptr<const Mesh> mesh, const SimdopOptions& options, core::ThreadPool& pool) {
  PRESCENE_CHECK(mesh != nullptr);
  check(options);
  const DopDirections& directions = DopDirections::of(options.k);
  SimdopTree tree;
  tree.options_ = options;
  tree.space_ = DopSpace::of(*mesh);
  Hierarchy shape = build_hierarchy(
      triangle_items(*mesh),
      {.builder = options.builder, .branching = options.branching, .leaf_items = options.leaf_items}, pool);
  add_root(shape);
  const std::vector<float> fitted = fit_planes(directions, tree.space_, *mesh, shape, pool);
  Layout layout = lay_out(shape);
  if (options.precision == PlanePrecision::kHalf) {
    choose_shifts(options, fitted, layout);
    // With room for the rounding of the difference.
    tree.half_planes_ = arrange<std::uint16_t>(options, shape, layout, fitted, pool,
                                               [](double x) { return round_up_to_half(x + 1e-15); });
  } else {
    tree.single_planes_ =
        arrange<float>(options, shape, layout, fitted, pool, [](double x) { return static_cast<float>(x); });
  }
  tree.mesh_ = std::move(mesh);
  tree.nodes_ = Array<Node>(std::move(layout.nodes));
  if (options.leaf_items > 1) tree.leaf_begin_ = Array<std::uint32_t>(std::move(layout.leaf_begin));
  tree.order_ = Array<std::uint32_t>(std::move(layout.order));
  return tree;
}

}  // namespace prescene::collision
