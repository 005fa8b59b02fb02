// SPDX-License-Identifier: Apache-2.0
// How one node's items are cut into parts: what the builders differ in. The growing of the tree is common to all.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

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

std::unique_ptr<Splitter> surface_area_splitter(std::span<const Item> items, const HierarchyOptions& options,
                                                core::ThreadPool& pool);

}  // namespace prescene::collision
