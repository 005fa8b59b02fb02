// SPDX-License-Identifier: Apache-2.0
// Bins of the surface-area heuristic [Wald 2007]: boxes of items sorted into bins by their centres along each axis, and
// the plane between bins that costs least.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace prescene::collision::surface_area {

inline constexpr int kMostBins = 32;
inline constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// An item's box in units of about the size of all; the fourth lane of `low` holds the item's number.
struct Record {
  Eigen::Array4f low;
  Eigen::Array4f high;

  Eigen::Array4f centre() const { return low + high; }
};

struct Box {
  Eigen::Array4f low = Eigen::Array4f::Constant(kInfinity);
  Eigen::Array4f high = Eigen::Array4f::Constant(-kInfinity);

  void add(const Eigen::Array4f& a, const Eigen::Array4f& b) {
    low = low.min(a);
    high = high.max(b);
  }
  void add(const Box& box) { add(box.low, box.high); }
  float half_area() const {
    const Eigen::Array4f e = high - low;
    return e[0] * e[1] + e[1] * e[2] + e[2] * e[0];
  }
};

struct Part {
  std::uint32_t begin = 0;
  std::uint32_t end = 0;
  float cost = 0.0F;
  Box centres;

  std::uint32_t size() const { return end - begin; }
};

/// Which bin a centre belongs to. Axes along which all centres are equal have one bin.
struct Binning {
  Binning(const Box& centres, int bin_count) : bins(bin_count), low(centres.low) {
    for (int axis = 0; axis < 3; ++axis) {
      const float extent = centres.high[axis] - centres.low[axis];
      scale[axis] = extent > 1e-30F ? static_cast<float>(bins) * (1.0F - 1e-6F) / extent : 0.0F;
    }
  }
  Eigen::Array4i of(const Eigen::Array4f& centre) const {
    return ((centre - low) * scale).cast<int>().max(0).min(bins - 1);
  }
  int of(const Eigen::Array4f& centre, int axis) const {
    return std::clamp(static_cast<int>((centre[axis] - low[axis]) * scale[axis]), 0, bins - 1);
  }

  int bins;
  Eigen::Array4f low;
  Eigen::Array4f scale = Eigen::Array4f::Zero();
};

struct Bins {
  std::array<std::array<Box, kMostBins>, 3> boxes;
  std::array<std::array<std::uint32_t, kMostBins>, 3> counts = {};

  void add(const Record& record, const Binning& binning) {
    const Eigen::Array4i bin = binning.of(record.centre());
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<std::size_t>(bin[static_cast<int>(axis)]);
      boxes[axis][i].add(record.low, record.high);
      ++counts[axis][i];
    }
  }
  void add(const Bins& other, int bins) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (std::size_t i = 0; i < static_cast<std::size_t>(bins); ++i) {
        boxes[axis][i].add(other.boxes[axis][i]);
        counts[axis][i] += other.counts[axis][i];
      }
    }
  }
};

struct Plane {
  float cost = kInfinity;
  int axis = -1;
  int bin = 0;  ///< The first bin on the right.
  float left_cost = 0.0F;
  float right_cost = 0.0F;
};

/// Takes the cheapest plane across an axis if it costs less than `best`.
inline void improve(Plane& best, const Bins& bins, int bin_count, int axis) {
  const auto& boxes = bins.boxes[static_cast<std::size_t>(axis)];
  const auto& counts = bins.counts[static_cast<std::size_t>(axis)];
  std::array<float, kMostBins> right_costs = {};
  Box box;
  std::uint32_t count = 0;
  for (int i = bin_count - 1; i > 0; --i) {
    const auto k = static_cast<std::size_t>(i);
    box.add(boxes[k]);
    count += counts[k];
    right_costs[k] = count > 0 ? box.half_area() * static_cast<float>(count) : kInfinity;
  }
  box = {};
  count = 0;
  for (int i = 1; i < bin_count; ++i) {
    const auto k = static_cast<std::size_t>(i);
    box.add(boxes[k - 1]);
    count += counts[k - 1];
    if (count == 0) continue;
    const float left_cost = box.half_area() * static_cast<float>(count);
    if (left_cost + right_costs[k] < best.cost) best = {left_cost + right_costs[k], axis, i, left_cost, right_costs[k]};
  }
}

}  // namespace prescene::collision::surface_area
