// SPDX-License-Identifier: Apache-2.0
// How high a body must get to leave a region, or to enter it, past fixed things of any shape.
//
// A body that holds a ball about its centre of mass keeps that centre at least the ball's radius from every fixed
// surface. The places where the centre may be are found on a grid, and a search by rising water level (a minimax
// shortest path) finds for each the lowest height that a way to the region has to pass. Conservative: a cell is closed
// only when all of it is too near to a surface, and a way's height is that of its cells' lower sides.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

#include "prescene/geometry/triangle_mesh.h"

namespace prescene::simulation {

/// A ball about the centre of mass that a body holds.
struct SpillBall {
  double radius = 0.0;  ///< m
  /// m that surfaces may come into it all the same: bodies sink into each other, and round shapes are meshes here.
  double slack = 1e-3;
};

class SpillLevels {
 public:
  using Vector3d = geometry::Vector3d;
  /// Whether a box (low, high) holds a point of the region.
  using Region = std::function<bool(const Vector3d& low, const Vector3d& high)>;

  /// `surfaces` in W. The grid covers `domain` (m); what is beyond it is one open place without floor, of the region if
  /// `region_beyond`.
  SpillLevels(const std::vector<geometry::TriangleMesh>& surfaces, const geometry::Box& domain, const SpillBall& ball,
              const Region& region, bool region_beyond);
  /// The same places for the ball, another region: most of the work is finding the places.
  SpillLevels(const SpillLevels& same_places, const Region& region, bool region_beyond);

  /// Height (m) that the centre must reach to get from p to the region, at least; minus infinity inside of it and where
  /// the grid knows of no place for the ball, infinity where no way leads.
  double level(const Vector3d& p) const;

 private:
  static constexpr int kNone = std::numeric_limits<int>::max();
  std::size_t cell(int i, int j, int k) const {
    return (static_cast<std::size_t>(k) * static_cast<std::size_t>(count_[1]) + static_cast<std::size_t>(j)) *
               static_cast<std::size_t>(count_[0]) +
           static_cast<std::size_t>(i);
  }
  Vector3d low_of(int i, int j, int k) const { return origin_ + size_ * Vector3d(i, j, k); }
  void close_near(const geometry::TriangleMesh& surface, double distance);
  void flood(const Region& region, bool region_beyond);
  double height(int level) const;

  Vector3d origin_;
  double size_ = 0.0;
  std::array<int, 3> count_ = {};
  std::vector<std::uint8_t> closed_;
  std::vector<int> levels_;  // layer of the grid; -1 = without bound below
  int beyond_ = kNone;
};

}  // namespace prescene::simulation
