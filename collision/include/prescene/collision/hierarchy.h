// SPDX-License-Identifier: Apache-2.0
// How the items of a tree (triangles, spheres) are grouped: the shape of the tree without its bounding volumes. Every
// tree of this library is a hierarchy with volumes fitted to it.
//
//   Hierarchy shape = build_hierarchy(items, {.builder = Builder::kSurfaceAreaHeuristic, .branching = 16}, pool);
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "prescene/collision/mesh.h"
#include "prescene/core/parallel.h"

namespace prescene::collision {

/// What a builder knows of an item.
struct Item {
  std::array<float, 3> low;  ///< Of its bounding box, m.
  std::array<float, 3> high;
  std::array<float, 3> centre;  ///< Centroid of the triangle, centre of the sphere.
  float weight = 1.0F;          ///< Importance for magnification control: area of the triangle, volume of the sphere.
};

/// How a set of items is split.
enum class Builder {
  kLongestAxis,           ///< Sorted along the longest axis of the box of centres, cut into equal parts.
  kExtendedLongestAxis,   ///< Halves along the longest axis, again and again, until there are enough parts.
  kMiddle,                ///< At the middle of the box along each axis (8 parts), longest axis first where fewer fit.
  kMedian,                ///< At the median along each axis.
  kSurfaceAreaHeuristic,  ///< Binned [Wald 2007]; the part with the largest cost is split until there are enough.
  kNeuralGas,             ///< Batch neural gas [Cottrell et al. 2006] on the centres.
  kWeightedNeuralGas,     ///< The same with magnification control by the items' weights [Hammer et al. 2007].
};
inline constexpr std::array<Builder, 7> kAllBuilders = {
    Builder::kLongestAxis,          Builder::kExtendedLongestAxis, Builder::kMiddle,           Builder::kMedian,
    Builder::kSurfaceAreaHeuristic, Builder::kNeuralGas,           Builder::kWeightedNeuralGas};
std::string_view to_string(Builder builder);

struct HierarchyOptions {
  Builder builder = Builder::kSurfaceAreaHeuristic;
  int branching = 16;  ///< Most children of a node: 2 to 16.
  int leaf_items = 1;  ///< Most items of a leaf: 1 to 64.

  friend bool operator==(const HierarchyOptions&, const HierarchyOptions&) = default;
};

/// Nodes this deep are cut into equal parts, whatever the builder.
inline constexpr int kDeepestBuilderCut = 48;
/// Binary logarithm of the most items.
inline constexpr int kMostItemsBits = 30;
/// How far below the root a node can be: equal parts are halves at least.
inline constexpr int kDeepestNode = kDeepestBuilderCut + kMostItemsBits;

/// Node 0 is the root; the children of a node are consecutive and come after it. Every item is in one leaf.
struct Hierarchy {
  struct Node {
    std::uint32_t begin = 0;  ///< Range of `order` below this node.
    std::uint32_t end = 0;
    std::uint32_t first_child = 0;
    std::uint32_t child_count = 0;  ///< 0: a leaf.
    bool is_leaf() const { return child_count == 0; }
  };
  std::vector<std::uint32_t> order;  ///< Items in the order of the leaves.
  std::vector<Node> nodes;
};

/// At least one item and at most 2^kMostItemsBits (checked). The same for any number of threads; ends for any input,
/// also when all centres are equal: items that a builder cannot tell apart are cut into equal parts.
Hierarchy build_hierarchy(std::span<const Item> items, const HierarchyOptions& options, core::ThreadPool& pool);

/// One item a triangle; weight is its area.
std::vector<Item> triangle_items(const Mesh& mesh);

}  // namespace prescene::collision
