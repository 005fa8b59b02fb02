// SPDX-License-Identifier: Apache-2.0
// What UncertainScratch holds: among it, the spheres of a packed body that touch a static shape first.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "prescene/collision/spheres/sphere_queries.h"
#include "prescene/collision/spheres/uncertain_sphere_queries.h"
#include "prescene/geometry/pose.h"
#include "uncertain_lanes.h"

namespace prescene::collision {

/// In A's frame, m.
struct CriticalSphere {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< The shape's, at its place nearest to the centre.
  double gap = 0.0;                                   ///< Distance of the shape from the sphere.
  double radius = 0.0;
  double deviation = 0.0;  ///< Of the gap, where the shape is flat.
  double rank = 0.0;       ///< The gap in these.
  double margin = 0.0;     ///< Not less than as long is an error that closes the gap; below 0: it may touch.
  geometry::Vector6d slope = geometry::Vector6d::Zero();  ///< Of the gap by the normal numbers behind the error.
};

struct CriticalSpheres {
  static constexpr std::size_t kMost = 64;

  const CriticalSphere* begin() const { return spheres.data(); }
  const CriticalSphere* end() const { return spheres.data() + size; }
  /// The one that needs the least error. There is one.
  const CriticalSphere& leader() const {
    return *std::min_element(begin(), end(), [](const auto& x, const auto& y) { return x.rank < y.rank; });
  }

  std::array<CriticalSphere, kMost> spheres;
  std::size_t size = 0;
  bool certain = false;       ///< One of them touches wherever its centre is within the ball of confidence.
  bool complete = true;       ///< No sphere with a margin within the region was left out.
  double least_margin = 0.0;  ///< Of all spheres, also those that were left out.
};

struct UncertainScratch::Memory {
  /// Of a descent of one tree.
  struct OpenNode {
    std::uint32_t node;
    double rank;    ///< About the least of the spheres below.
    double margin;  ///< No sphere below has less.
  };

  DescentStack stack;
  std::vector<OpenNode> nodes;
  CriticalPairs critical;
  CriticalSpheres critical_spheres;
  ErrorLines lines;
  TouchingIntervals intervals;
  /// Normal numbers of six dimensions that lines are laid through.
  std::array<geometry::Vector6d, ErrorLines::kCount> points;
  static constexpr std::size_t kDraws = 256;
  /// Normal numbers of twelve dimensions: errors of two poses.
  std::vector<Eigen::Matrix<double, 12, 1>> draws;
  SphereScratch at_draws;
};

}  // namespace prescene::collision
