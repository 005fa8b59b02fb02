// SPDX-License-Identifier: Apache-2.0
// How one node's items are cut into parts: what the builders differ in. The growing of the tree is common to all.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "prescene/collision/hierarchy.h"

namespace prescene::collision {

inline constexpr int kMostChildren = 16;

/// Ends of the parts of a range of items: part i is [at[i], at[i + 1]).
struct Cuts {
  std::array<std::uint32_t, kMostChildren + 1> at = {};
  std::uint32_t parts = 0;
};

/// [begin, end) in `parts` parts whose sizes differ by at most one.
Cuts equal_cuts(std::uint32_t begin, std::uint32_t end, std::uint32_t parts);

/// Keeps the items in an order of its own. Disjoint ranges are split from several threads at once.
class Splitter {
 public:
  virtual ~Splitter() = default;
  /// Reorders [begin, end), more items than a leaf holds, so that the parts follow each other. Two parts at least, none
  /// of them empty; the same parts whatever the number of threads.
  virtual Cuts split(std::uint32_t begin, std::uint32_t end) = 0;
  /// The item that is now at place i.
  virtual std::uint32_t item(std::size_t i) const = 0;
};

/// As build_hierarchy, of `count` items.
Hierarchy grow_hierarchy(Splitter& splitter, std::uint32_t count, const HierarchyOptions& options,
                         core::ThreadPool& pool);

/// What the builders that look at centres only keep of an item.
struct Centre {
  std::array<float, 3> position = {};  ///< Divided by the largest coordinate of all.
  float weight = 0.0F;                 ///< Divided by the largest.
  std::uint32_t item = 0;
};
std::vector<Centre> centres_of(std::span<const Item> items);

struct CentreBox {
  std::array<float, 3> low;
  std::array<float, 3> high;

  float extent(std::size_t axis) const { return high[axis] - low[axis]; }
  /// Axes, longest first; the first of equally long ones first.
  std::array<std::size_t, 3> axes_by_length() const;
};
CentreBox box_of(std::span<const Centre> centres);

/// The middle of a range, after its lower half along the axis was put first; equal positions in the order of items.
std::uint32_t halve_at_median(std::span<Centre> centres, std::uint32_t begin, std::uint32_t end, std::size_t axis);

std::unique_ptr<Splitter> surface_area_splitter(std::span<const Item> items, const HierarchyOptions& options,
                                                core::ThreadPool& pool);
/// The same over the triangles of a mesh, where each node is cut along its principal axes if its box is smaller there.
std::unique_ptr<Splitter> turned_surface_area_splitter(const Mesh& mesh, const HierarchyOptions& options,
                                                       core::ThreadPool& pool);
/// Longest axis, extended longest axis, middle and median.
std::unique_ptr<Splitter> axis_splitter(std::span<const Item> items, const HierarchyOptions& options);
/// Neural gas, with and without weights.
std::unique_ptr<Splitter> neural_gas_splitter(std::span<const Item> items, const HierarchyOptions& options);

}  // namespace prescene::collision
