// SPDX-License-Identifier: Apache-2.0
// Exact nearest neighbours in a fixed set of points.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "prescene/geometry/pose.h"

namespace prescene::geometry {

class PointTree {
 public:
  struct Nearest {
    std::uint32_t index = 0;  ///< Into the points that the tree was built of.
    double squared_distance = 0.0;
  };

  /// Copies the points: at least one, all finite (checked).
  explicit PointTree(std::span<const Vector3d> points);
  ~PointTree();
  PointTree(PointTree&&) noexcept;
  PointTree& operator=(PointTree&&) noexcept;

  std::size_t size() const;
  /// The nearest point; of several at the same distance always the same one. No allocation.
  Nearest nearest(const Vector3d& q) const;
  /// The same, faster the nearer the point of index `hint` is to q.
  Nearest nearest(const Vector3d& q, std::uint32_t hint) const;
  /// The points' indices in an order in which neighbours are near each other: queries along it find good hints.
  std::span<const std::uint32_t> order() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace prescene::geometry
